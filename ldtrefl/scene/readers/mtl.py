"""MTL files -> materials.

Wavefront's format says what a colour is, and not how it is encoded. Programs that write MTL files today differ;
Blender, whose files are the most, writes and reads linear numbers, and so they are taken here. Pictures are sRGB.

What is not Wavefront's own (``Ks`` and ``Ns`` in terms of a physical model) follows Blender's importer too: its 0.5,
which it writes for a plain dielectric, is a reflectance of 0.04. ``Pr``, ``Pm`` and their maps are those of the
extension for physically based materials, in glTF's terms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ldtrefl.base import budget
from ldtrefl.files.stored_picture import StoredPicture
from ldtrefl.scene.readers.byte_order_marks import without_mark
from ldtrefl.scene.readers.obj_text import BLANKS, CONTINUED, as_text
from ldtrefl.scene.readers.pictures import (
    Pictures,
    is_grey,
    is_opaque,
    roughness_and_metallic,
    with_alpha_of,
)
from ldtrefl.scene.surface_material import IDENTITY, Rgb, SurfaceMaterial, Texture

BYTES_PER_BYTE = 40
"""Bytes that a byte of an MTL file may take as words, at most; measured."""

OF_COLORS = {"kd": 3, "ks": 3, "ke": 3}
"""Statements of one number or three."""

OF_PICTURES = ("map_kd", "map_ke", "map_d", "map_pr", "map_pm", "norm", "map_bump", "bump")

SHOWN = (*OF_COLORS, *OF_PICTURES, "ns", "d", "tr", "illum", "pr", "pm")

WITHOUT_EFFECT = ("ka", "map_ka", "ni", "sharpness", "map_aat")
"""Ambient light comes with the diffuse colour here, and the rest says how other programs render: nothing is lost."""

ARGUMENTS = {
    **{"-o": 3, "-s": 3, "-t": 3, "-mm": 2, "-bm": 1, "-clamp": 1, "-blendu": 1, "-blendv": 1, "-boost": 1},
    **{"-texres": 1, "-type": 1, "-imfchan": 1, "-cc": 1, "-colorspace": 1},
}
"""Options of pictures, and how many words follow each: of the first three, as many as are numbers."""

OF_NUMBERS = ("-o", "-s", "-t")

WITHOUT_LOSS = {("-blendu", "on"), ("-blendv", "on"), ("-cc", "off"), ("-clamp", "off")}
"""Options, each with the word behind it, that say what is done anyway."""

BLENDERS_EXPONENT = 1000.0
"""The specular exponent that Blender takes for a mirror."""


Entry = dict[str, str]
"""A material: its statements in lower case, and what stands behind each."""


@dataclass(eq=False)
class MaterialLibrary:
    """The materials of a mesh's MTL files, by name; each is made when it is first asked for."""

    pictures: Pictures
    not_shown: list[str] = field(default_factory=list)
    _entries: dict[str, Entry] = field(default_factory=dict)
    _made: dict[str, SurfaceMaterial] = field(default_factory=dict)

    def add(self, data: bytes) -> None:
        """Add the materials of a file. Of several with one name the first counts.

        Raises:
            InputError: it takes more memory than is allowed.
        """
        budget.take(BYTES_PER_BYTE * len(data), "the materials")
        entry: Entry = {}
        data = without_mark(data).replace(b"\r\n", b"\n").replace(b"\r", b"\n") + b"\n"
        data = CONTINUED.sub(lambda match: match[0].replace(b"\\\n", b" "), data)
        for line in data.translate(BLANKS).split(b"\n"):
            text = as_text(line)
            if text.startswith("#") or not text:
                continue
            word, _, rest = text.partition(" ")
            rest = rest.partition(" #")[0].strip()
            if word.lower() == "newmtl":
                entry = {}
                self._entries.setdefault(rest, entry)
            else:
                entry[word.lower()] = rest

    def __contains__(self, name: str) -> bool:
        return name in self._entries

    def material(self, name: str) -> SurfaceMaterial | None:
        """A material; None if no file has it.

        Raises:
            InputError: a picture is larger than is allowed.
        """
        if name not in self._entries:
            return None
        if name not in self._made:
            self._made[name] = self._of(name, self._entries[name])
        return self._made[name]

    def _of(self, name: str, entry: Entry) -> SurfaceMaterial:
        entry = self._checked(name, entry)
        base = self._texture(name, entry, "map_kd")
        alpha_texture = self._texture(name, entry, "map_d")
        alpha = _alpha(entry)
        if alpha <= 0.0:
            self.not_shown.append(f"material '{name}': d or Tr makes it wholly transparent")
        made = SurfaceMaterial(
            name=name,
            base_color=_base_color(entry, has_picture=base is not None),
            base_texture=base,
            alpha=alpha,
            alpha_mode="blend" if alpha < 1.0 else "opaque",
            emission=_color(entry, "ke", 1.0 if "map_ke" in entry else 0.0),
            emission_texture=self._texture(name, entry, "map_ke"),
        )
        if made.emission_texture is not None and made.emission == (0.0, 0.0, 0.0):
            made = replace(made, emission=(1.0, 1.0, 1.0))
        elif "map_ke" in entry and made.emission_texture is None and "ke" not in entry:
            made = replace(made, emission=(0.0, 0.0, 0.0))
        if alpha_texture is not None:
            made = self._masked(made, alpha_texture)
        elif base is not None and not is_opaque(base.picture):
            self.not_shown.append(f"material '{name}': the alpha of its picture (no map_d names it)")
            made = replace(made, base_texture=replace(base, picture=StoredPicture(base.picture.pixels)))
        return self._bumpy(self._glossy(made, name, entry), name, entry)

    def _checked(self, name: str, entry: Entry) -> Entry:
        """The statements that are shown. Others, and those whose numbers are none, are noted."""
        checked = {}
        for key, rest in entry.items():
            words = [word for word in rest.split() if word != "-halo"][: OF_COLORS.get(key, 1)]
            if key in WITHOUT_EFFECT:
                continue
            if key not in SHOWN:
                self._miss(name, key)
            elif key not in OF_PICTURES and not (words and all(map(_is_number, words))):
                self._miss(name, f"{key} {rest[:40]} (it should be numbers)")
            else:
                checked[key] = rest if key in OF_PICTURES else " ".join(words)
        return checked

    def _masked(self, made: SurfaceMaterial, mask: Texture) -> SurfaceMaterial:
        """The material with alpha from a picture."""
        base = made.base_texture
        if base is None:
            texture = replace(mask, picture=with_alpha_of(None, mask.picture))
        else:
            if base.transform != mask.transform or base.wrap != mask.wrap:
                self.not_shown.append(f"material '{made.name}': options of map_d other than those of map_Kd")
            texture = replace(base, picture=with_alpha_of(base.picture, mask.picture))
        return replace(made, base_texture=texture, alpha_mode="blend")

    def _glossy(self, made: SurfaceMaterial, name: str, entry: Entry) -> SurfaceMaterial:
        """The material with its reflection, where the file says that it has one."""
        strength = [min(max(value, 0.0), 1.0) for value in _color(entry, "ks", 0.5)]
        is_physical = any(key in entry for key in ("pr", "pm", "map_pr", "map_pm"))
        if not is_physical and ("ks" not in entry or _number(entry, "illum", 2.0) < 2.0 or max(strength) == 0.0):
            return made
        exponent = min(max(_number(entry, "ns", 0.0), 0.0), BLENDERS_EXPONENT)
        roughness = _number(entry, "pr", 1.0 - math.sqrt(exponent / BLENDERS_EXPONENT))
        rough, metal = (self._texture(name, entry, key, is_data=True) for key in ("map_pr", "map_pm"))
        both = None
        if rough is not None or metal is not None:
            first = rough or metal
            assert first is not None
            joined = roughness_and_metallic(
                None if rough is None else rough.picture, None if metal is None else metal.picture
            )
            both = replace(first, picture=joined)
        # Reflectance is 0.08 times Ks: half of it is glTF's 0.04, and the rest of its tint.
        scale = min(2.0 * max(strength), 1.0)
        red, green, blue = (2.0 * value / scale if scale else 1.0 for value in strength)
        return replace(
            made,
            roughness=1.0 if rough is not None and "pr" not in entry else min(max(roughness, 0.0), 1.0),
            metallic=min(max(_number(entry, "pm", 0.0 if metal is None else 1.0), 0.0), 1.0),
            metallic_roughness_texture=both,
            specular=scale,
            specular_color=(red, green, blue),
        )

    def _bumpy(self, made: SurfaceMaterial, name: str, entry: Entry) -> SurfaceMaterial:
        """The material with its map of normals. Programs write one as a map of heights, too; its colours tell."""
        for key in ("norm", "map_bump", "bump"):
            if key not in entry:
                continue
            texture = self._texture(name, entry, key, is_data=True)
            if texture is None:
                continue
            if key != "norm" and is_grey(texture.picture):
                self._miss(name, f"{key} (heights)")
                continue
            strength = _options(entry[key])[0].get("-bm", [])
            scale = float(strength[0]) if strength and _is_number(strength[0]) else 1.0
            return replace(made, normal_texture=texture, normal_scale=scale)
        return made

    def _texture(self, name: str, entry: Entry, key: str, *, is_data: bool = False) -> Texture | None:
        """The picture that a statement names, and how its options lay it; None if there is none to be had."""
        if key not in entry:
            return None
        options, file = _options(entry[key])
        if not file:
            self.not_shown.append(f"material '{name}': {key} names no picture")
            return None
        picture = self.pictures.get(file, with_alpha=key in ("map_kd", "map_d"))
        if picture is None:
            return None
        for option, words in options.items():
            pair = (option, words[0].lower() if words else "")
            is_shown = option in ("-o", "-s", "-clamp") or pair in WITHOUT_LOSS or (option == "-bm" and is_data)
            if not is_shown and (option, words) != ("-mm", ["0", "1"]):
                self._miss(name, f"the option {option} of {key}")
        clamps = options.get("-clamp", ["off"])[:1] == ["on"]
        return Texture(
            picture,
            wrap=("clamp", "clamp") if clamps else ("repeat", "repeat"),
            transform=_transform(options),
            is_data=is_data,
        )

    def _miss(self, name: str, what: str) -> None:
        """Note that something of a material is not shown: each kind once."""
        if not any(line.endswith(f": {what}") for line in self.not_shown):
            self.not_shown.append(f"material '{name[:60]}': {what}")


def _options(rest: str) -> tuple[dict[str, list[str]], str]:
    """(the options of a picture with the words that follow each, the picture's name, which may hold blanks)."""
    words, at = rest.split(), 0
    options: dict[str, list[str]] = {}
    while at < len(words) and words[at].lower() in ARGUMENTS:
        option = words[at].lower()
        end = at + 1 + ARGUMENTS[option]
        if option in OF_NUMBERS:
            end = next((k for k in range(at + 1, min(end, len(words))) if not _is_number(words[k])), end)
        options[option] = words[at + 1 : end]
        at = end
    remaining = rest.split(None, at)
    return options, remaining[at].strip() if len(remaining) > at else ""


def _transform(options: dict[str, list[str]]) -> tuple[float, ...]:
    """Of -s and -o, which scale and then move texture coordinates with v = 0 at the bottom."""
    if "-s" not in options and "-o" not in options:
        return IDENTITY
    sizes = [float(word) for word in options.get("-s", [])] + [1.0, 1.0, 1.0]
    moves = [float(word) for word in options.get("-o", [])] + [0.0, 0.0, 0.0]
    if len(options.get("-s", [])) == 1:
        sizes[1] = sizes[0]
    return (sizes[0], 0.0, moves[0], 0.0, sizes[1], 1.0 - sizes[1] - moves[1])


def _base_color(entry: Entry, *, has_picture: bool) -> Rgb:
    color = _color(entry, "kd", 1.0)
    # Programs that mean the picture alone write so.
    return (1.0, 1.0, 1.0) if has_picture and color == (0.0, 0.0, 0.0) else color


def _alpha(entry: Entry) -> float:
    if "d" in entry:
        return min(max(_number(entry, "d", 1.0), 0.0), 1.0)
    return min(max(1.0 - _number(entry, "tr", 0.0), 0.0), 1.0)


def _number(entry: Entry, key: str, otherwise: float) -> float:
    return float(entry[key]) if key in entry else otherwise


def _color(entry: Entry, key: str, otherwise: float) -> Rgb:
    """A colour of one number, or three."""
    if key not in entry:
        return (otherwise,) * 3
    values = [max(float(word), 0.0) for word in entry[key].split()]
    return (values[0], values[0], values[0]) if len(values) < 3 else (values[0], values[1], values[2])


def _is_number(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False
