"""Options of the picture that a command writes, and what they mean."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from ldtrefl.base.errors import InputError
from ldtrefl.files.layer_writing import check_layers_writable, save_layers
from ldtrefl.files.picture_format import JPEG, PictureFormat
from ldtrefl.files.picture_writing import check_writable, save_image
from ldtrefl.frame.result import Frame
from ldtrefl.scene.description import Scene
from ldtrefl.scene.picture import Picture

Exposure = Annotated[
    float | None,
    typer.Option(
        "--exposure", metavar="STOPS", help="Each shows everything twice as bright; the scene's if not given."
    ),
]
ToneMapping = Annotated[
    str | None, typer.Option("--tone-mapping", metavar="NAME", help="none, agx or aces; the scene's if not given.")
]
Bits = Annotated[int | None, typer.Option("--bits", metavar="8|16", help="Of a channel of a PNG; 8 if not given.")]
Quality = Annotated[
    int | None,
    typer.Option("--quality", metavar="1..100", help="Of JPEG and WebP; 92 if not given, 100 loses nothing."),
]
Transparent = Annotated[bool, typer.Option("--transparent", help="Leave out what lies behind all objects.")]
AsLayers = Annotated[
    bool, typer.Option("--layers", help="Write an EXR of what the picture is made of: reflections, depth, normals, ...")
]


@dataclass(frozen=True)
class PictureOptions:
    """What is written of a frame, and where; checked before any work is spent on it.

    Raises:
        InputError: the file cannot be written, or an option is not allowed, or not for such a file.
    """

    path: Path
    exposure: float | None
    tone_mapping: str | None
    bits: int | None
    quality: int | None
    is_transparent: bool
    has_layers: bool

    def __post_init__(self) -> None:
        check_layers_writable(self.path) if self.has_layers else check_writable(self.path)
        PictureFormat.checked(self.path, **self._given)
        if self.is_transparent and self.path.suffix.lower() in JPEG:
            raise InputError(f"{self.path}: a JPEG cannot be transparent, PNG, WebP and EXR can")

    @property
    def _given(self) -> dict[str, Any]:
        """The options of the file's format that were given."""
        given = {"bits": self.bits, "quality": self.quality, **self._development}
        return {name: value for name, value in given.items() if value is not None}

    @property
    def _development(self) -> dict[str, Any]:
        """What was given of what a scene says, too."""
        given = {"exposure": self.exposure, "tone_mapping": self.tone_mapping}
        return {name: value for name, value in given.items() if value is not None}

    def of_scene(self, scene: Scene) -> Scene:
        """The scene with what was given in place of what it says of its picture."""
        if not self._development:
            return scene
        return dataclasses.replace(scene, picture=dataclasses.replace(scene.picture, **self._development))

    def write(self, frame: Frame, picture: Picture) -> None:
        """Write a frame, developed as its scene's ``picture`` says; an EXR holds the radiance as it is."""
        if self.has_layers:
            save_layers(self.path, frame.layers(cutout=self.is_transparent))
            return
        by_scene = {} if self.path.suffix.lower() == ".exr" else dataclasses.asdict(picture)
        save_image(self.path, frame.cutout if self.is_transparent else frame.image, **(self._given | by_scene))
