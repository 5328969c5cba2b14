"""Errors of every bounce, against errors that are planted and known on paper."""

import io

import numpy as np
from rich.console import Console

from ldtrefl.compare.bounces import BounceErrors, bounce_table, errors_by_bounce
from ldtrefl.frame.bounce_hits import BounceHits, FirstHits
from tests.compare.metrics.first_hits import bounce_hits, first_hits

TEXELS = np.array([0.25, 2.0])
"""Lengths in the world of a texel of two objects."""

MASK = (np.arange(100) < 80).reshape(10, 10)


class Bounce:
    """Where 100 rays end, to be written into."""

    def __init__(self, followed: np.ndarray) -> None:
        self.followed = followed
        self.objects = np.where(followed, np.arange(100) % 2, -1)
        self.distance = np.where(followed, 3.0 + 0.01 * np.arange(100), np.inf)

    def end(self, rays: range, objects: int, distance: float) -> None:
        """Let rays end elsewhere."""
        self.objects[rays], self.distance[rays] = objects, distance

    def hits(self) -> BounceHits:
        pictures = (values.reshape(10, 10) for values in (self.objects, self.distance, self.followed))
        return bounce_hits(*pictures)


def three_bounces() -> list[Bounce]:
    """All 100 rays, of which 60 and then 30 go on from mirrors; every ray meets something."""
    return [Bounce(np.arange(100) < count) for count in (100, 60, 30)]


def together(bounces: list[Bounce]) -> FirstHits:
    first, *later = bounces
    pictures = first.objects.reshape(10, 10), first.distance.reshape(10, 10)
    return first_hits(*pictures, later=tuple(bounce.hits() for bounce in later))


def test_the_same_rays_have_no_errors() -> None:
    truth = together(three_bounces())
    expected = tuple(BounceErrors(k + 1, count, 0, 0, 0) for k, count in enumerate((80, 60, 30)))
    assert errors_by_bounce(truth, truth, TEXELS, MASK) == expected


def test_rays_that_end_wrongly_are_counted_at_their_bounce_and_not_after_it() -> None:
    truth, made = three_bounces(), three_bounces()
    made[0].end(range(4), -1, np.inf)  # missed; they go on in the truth alone
    made[1].followed[:4] = made[2].followed[:4] = False
    made[0].end(range(90, 100), -1, np.inf)  # outside the mask
    made[1].end(range(10, 13), -1, np.inf)
    made[1].objects[20:22] = 1 - made[1].objects[20:22]  # the other object, at the very distance
    truth[1].end(range(40, 45), -1, np.inf)
    truth[2].end(range(25, 26), -1, np.inf)
    made[2].followed[29] = False  # one goes on no further
    assert errors_by_bounce(together(made), together(truth), TEXELS, MASK) == (
        BounceErrors(1, 80, 0, 4, 0),
        BounceErrors(2, 56, 5, 3, 2),
        BounceErrors(3, 30 - 4 - 3 - 2 - 1, 1, 0, 0),
    )


def test_rays_that_go_on_from_other_places_are_not_compared() -> None:
    """A texel of the object that is hit: rays that are off by more, or by what is no number, go other ways."""
    truth, made = three_bounces(), three_bounces()
    for ray, off in enumerate((0.9, -0.9, 1.1, -1.1, np.nan, np.inf)):
        made[0].distance[ray] += off * TEXELS[made[0].objects[ray]]
        made[1].end(range(ray, ray + 1), -1, np.inf)
    counts = [
        (errors.compared, errors.wrong_misses)
        for errors in errors_by_bounce(*map(together, (made, truth)), TEXELS, MASK)
    ]
    assert counts == [(80, 0), (56, 2), (24, 0)]


def test_bounces_that_the_method_does_not_have_are_not_compared() -> None:
    truth = three_bounces()
    found = errors_by_bounce(together(truth[:2]), together(truth), TEXELS, MASK)
    assert (
        found[2] == BounceErrors(3, 0, 0, 0, 0)
        and found[:2] == errors_by_bounce(*[together(truth)] * 2, TEXELS, MASK)[:2]
    )
    assert len(errors_by_bounce(together(truth), together(truth[:1]), TEXELS, MASK)) == 1


def test_the_table_has_a_line_a_bounce() -> None:
    rows = {
        "ldt": (BounceErrors(1, 80, 5, 6, 7), BounceErrors(2, 60, 8, 9, 10)),
        "other": (BounceErrors(1, 80, 1, 2, 3),),
    }
    said = io.StringIO()
    Console(width=200, file=said).print(bounce_table(rows, "a title"))
    cells = [
        [cell.strip() for cell in line.split("│")[1:-1]]
        for line in said.getvalue().splitlines()
        if line.startswith("│")
    ]
    assert cells == [
        ["ldt", "1", "80", "5", "6", "7"],
        ["", "2", "60", "8", "9", "10"],
        ["other", "1", "80", "1", "2", "3"],
    ]
