"""The paper's search as ``ldt/linear/march.py`` defines it, sample after sample, in NumPy's float32.

Slow, and plain: nothing is skipped, fragments are counted one by one. What the package answers has the same bits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BOX_MARGIN, CONSISTENT, DEEP = np.float32(0.01), np.float32(1.0), np.float32(2.0)

Float = np.float32


@dataclass(frozen=True)
class Answer:
    """Where a ray ends, in the units of its direction; +inf and -1 on a miss."""

    t: Float
    fragment: int


class LinearReference:
    """The search of rays given in texel space, in the maps of one object."""

    def __init__(self, maps: object, linear_steps: int | str, binary_steps: int = 8) -> None:
        self.size, self.first_texel = maps.frame.size, maps.frame.first_texels  # type: ignore[attr-defined]
        self.start, self.depth, up = (getattr(maps, name).numpy() for name in ("start", "depth", "reference"))
        up = up & 1
        self.winding = np.concatenate([[0], np.cumsum(2 * up - 1)])
        self.balanced = np.diff(self.winding[self.start]) == 0
        self.linear_steps, self.binary_steps = linear_steps, binary_steps

    def trace(self, origin: np.ndarray, direction: np.ndarray, t_max: float = np.inf) -> Answer:
        """The nearest crossing before ``t_max`` that a map confirms."""
        t_enter, t_exit = self._box_span(origin, direction)
        best = Answer(Float(np.inf), -1)
        if not (t_enter <= t_exit and t_enter < t_max):
            return best
        for axis in range(3):
            if direction[axis] != 0.0:
                found = self._search_map(axis, origin, direction, t_enter, t_exit)
                if found.fragment >= 0:
                    best = found
                    t_exit = found.t
        return best if best.t < t_max else Answer(Float(np.inf), -1)

    def _box_span(self, origin: np.ndarray, direction: np.ndarray) -> tuple[Float, Float]:
        t_enter, t_exit = Float(0.0), Float(np.inf)
        for axis in range(3):
            low, high = -BOX_MARGIN, Float(self.size[axis]) + BOX_MARGIN
            if direction[axis] == 0.0:
                if origin[axis] < low or origin[axis] > high:
                    t_exit = Float(-1.0)
            else:
                with np.errstate(over="ignore"):
                    a, b = (low - origin[axis]) / direction[axis], (high - origin[axis]) / direction[axis]
                t_enter, t_exit = max(t_enter, min(a, b)), min(t_exit, max(a, b))
        return t_enter, t_exit

    def _steps(self, direction: np.ndarray, t_enter: Float, t_exit: Float) -> int:
        if self.linear_steps != "texel":
            return int(self.linear_steps)
        x, y, z = np.abs(direction)
        return max(*self.size, int(np.ceil((t_exit - t_enter) * (x + y + z))))

    def _texels(self, axis: int, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """First fragments and ends of the texels that hold (n, 3) points."""
        u, v = (axis + 1) % 3, (axis + 2) % 3
        column = np.clip(np.floor(p[:, u]), 0, self.size[u] - 1).astype(int)
        row = np.clip(np.floor(p[:, v]), 0, self.size[v] - 1).astype(int)
        texel = self.first_texel[axis] + row * self.size[u] + column
        return texel, self.start[texel], self.start[texel + 1]

    def _inside(self, axis: int, direction: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Whether (n, 3) points are inside, as the map of ``axis`` sees it."""
        texel, first, end = self._texels(axis, p)
        k = first.copy()
        for _ in range(int((end - first).max())):
            k += (k < end) & (self.depth[np.minimum(k, len(self.depth) - 1)] <= p[:, axis])
        passed = k - first if direction[axis] > 0.0 else end - k
        return np.where(self.balanced[texel], self.winding[k] != self.winding[first], passed % 2 == 1)

    def _nearest(self, axis: int, p: np.ndarray, residual: Float, fragment: int) -> tuple[Float, int]:
        _, (first,), (end,) = self._texels(axis, p[None])
        for k in range(first, end):
            distance = abs(self.depth[k] - p[axis])
            if distance < residual:
                residual, fragment = distance, k
        return residual, fragment

    def _search_map(
        self, axis: int, origin: np.ndarray, direction: np.ndarray, t_enter: Float, t_exit: Float
    ) -> Answer:
        def state(t: np.ndarray) -> np.ndarray:
            return self._inside(axis, direction, origin + t[:, None] * direction)

        inside, leaving_counts = False, True
        if t_enter == 0.0:
            inside = bool(self._inside(axis, direction, origin[None])[0])
            if inside:
                leaving_counts = self._nearest(axis, origin, Float(np.inf), -1)[0] > DEEP
        steps = self._steps(direction, t_enter, t_exit)
        step = (t_exit - t_enter) / Float(steps)
        t = t_enter + np.arange(1, steps + 1, dtype=np.float32) * step
        states = state(t)
        for i in range(steps):
            if states[i] == inside:
                continue
            before, after = t[i] - step, t[i]
            for _ in range(self.binary_steps):
                middle = Float(0.5) * (before + after)
                if state(np.array([middle]))[0] != inside:
                    after = middle
                else:
                    before = middle
            if leaving_counts:
                found = self._nearest(axis, origin + after * direction, Float(np.inf), -1)
                residual, fragment = self._nearest(axis, origin + before * direction, *found)
                if residual <= CONSISTENT:
                    return Answer(after, fragment)
            inside, leaving_counts = not inside, True
        return Answer(Float(np.inf), -1)
