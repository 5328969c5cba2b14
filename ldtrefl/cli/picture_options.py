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


@dataclass(frozen=True)
class PictureOptions:
    """What is written of a frame, and where."""

    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="PNG, JPEG, WebP or EXR; the file's name with .png if not given."),
    ] = None
    exposure: Annotated[
        float | None,
        typer.Option(
            "--exposure", metavar="STOPS", help="Each shows everything twice as bright; the scene's if not given."
        ),
    ] = None
    tone_mapping: Annotated[
        str | None, typer.Option("--tone-mapping", metavar="NAME", help="none, agx or aces; the scene's if not given.")
    ] = None
    bits: Annotated[
        int | None, typer.Option("--bits", metavar="8|16", help="Of a channel of a PNG; 8 if not given.")
    ] = None
    quality: Annotated[
        int | None,
        typer.Option("--quality", metavar="1..100", help="Of JPEG and WebP; 92 if not given, 100 loses nothing."),
    ] = None
    transparent: Annotated[bool, typer.Option("--transparent", help="Leave out what lies behind all objects.")] = False
    layers: Annotated[
        bool,
        typer.Option("--layers", help="Write an EXR of what the picture is made of: reflections, depth, normals, ..."),
    ] = False

    def checked_path(self, scene: Path) -> Path:
        """The file that is written of a scene's frame, checked before any work is spent on it.

        Raises:
            InputError: it cannot be written, or an option is not allowed, or not for such a file.
        """
        path = self.output or Path(scene.stem + (".exr" if self.layers else ".png"))
        check_layers_writable(path) if self.layers else check_writable(path)
        PictureFormat.checked(path, **self._given)
        if self.transparent and path.suffix.lower() in JPEG:
            raise InputError(f"{path}: a JPEG cannot be transparent, PNG, WebP and EXR can")
        return path

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

    def write(self, path: Path, frame: Frame, picture: Picture) -> None:
        """Write a frame, developed as its scene's ``picture`` says; an EXR holds the radiance as it is."""
        if self.layers:
            save_layers(path, frame.layers(cutout=self.transparent))
            return
        by_scene = {} if path.suffix.lower() == ".exr" else dataclasses.asdict(picture)
        save_image(path, frame.cutout if self.transparent else frame.image, **(self._given | by_scene))
