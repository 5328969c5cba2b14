"""Arguments and options that several commands have, and what they mean."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from ldtrefl.base import budget
from ldtrefl.base.errors import InputError
from ldtrefl.device.launch import set_threads
from ldtrefl.files.regular_files import check_regular
from ldtrefl.scene import shapes
from ldtrefl.scene.description import MAX_SAMPLES, Scene
from ldtrefl.scene.load import load_scene
from ldtrefl.scene.mesh import Mesh
from ldtrefl.scene.readers import load_mesh
from ldtrefl.scene.stages import STAGES
from ldtrefl.scene.toml_text import parse_toml

SIZE = re.compile(r"([0-9]{1,6})[xX]([0-9]{1,6})")
"""How ``--size`` is written."""

Samples = Annotated[
    int | None,
    typer.Option(
        "--samples",
        min=1,
        max=MAX_SAMPLES,
        help="The most samples of a pixel, which it gets where it differs from its neighbours; the scene's number, or "
        "4, if not given.",
    ),
]
CacheFolder = Annotated[
    Path | None, typer.Option("--cache", metavar="DIR", help="Keep maps here; the user's cache folder if not given.")
]
Memory = Annotated[
    str | None,
    typer.Option(
        "--memory",
        metavar="SIZE",
        help="Memory that the scene may take, such as 8G or 512M; LDTREFL_MEMORY or else 4G if not given.",
    ),
]


@dataclass(frozen=True)
class Resources:
    """What a command may use."""

    device: Annotated[str | None, typer.Option(help="'cpu' (default) or a CUDA device such as 'cuda:0'.")] = None
    threads: Annotated[int | None, typer.Option(help="CPU threads; all cores if not given.")] = None
    memory: Memory = None

    def use(self) -> None:
        """Obey ``--memory`` and ``--threads``.

        Raises:
            InputError: one of them is not allowed, or ``LDTREFL_MEMORY`` is not.
        """
        set_threads(self.threads)
        allow_memory(self.memory)


def allow_memory(size: str | None) -> None:
    """Obey ``--memory``.

    Raises:
        InputError: it is not allowed, or ``LDTREFL_MEMORY`` is not.
    """
    budget.set_memory_limit(None if size is None else budget.size_of(size, "--memory"))
    budget.memory_limit()  # so that a wrong value in the environment is found before any work is done


@dataclass(frozen=True)
class SceneWanted:
    """A scene file, or a mesh file and what it is put on."""

    scene: Annotated[
        Path,
        typer.Argument(metavar="SCENE|MESH", help="A scene file (TOML), or a mesh file such as PLY, OBJ or GLB."),
    ]
    on: Annotated[
        str | None, typer.Option("--on", metavar="STAGE", help=f"Put a mesh on a stage: {', '.join(STAGES)}.")
    ] = None
    up: Annotated[
        str | None,
        typer.Option(
            "--up",
            metavar="AXIS",
            help="The axis of a mesh file that points up, such as y or -z; its kind's if not given.",
        ),
    ] = None
    turn: Annotated[
        float,
        typer.Option(
            "--turn", metavar="DEGREES", help="Turn a mesh about that axis, counterclockwise as seen from above."
        ),
    ] = 0.0
    mirror: Annotated[
        str | None, typer.Option("--mirror", metavar="self", help="'self' makes a mesh a mirror, on any stage.")
    ] = None
    size: Annotated[
        str | None, typer.Option("--size", metavar="WxH", help="Pixels of the picture; the scene's own if not given.")
    ] = None
    lenient: Annotated[
        bool, typer.Option("--lenient", help="Show what can be read of a glTF file that requires unknown extensions.")
    ] = False

    def loaded(self) -> Scene:
        """The scene.

        Raises:
            InputError: the file cannot be read, or an option is not allowed.
        """
        if self.mirror not in (None, "self"):
            raise InputError(f"--mirror {self.mirror}: only 'self' is allowed")
        return load_scene(
            self.scene,
            on=self.on,
            up=self.up,
            turn=self.turn,
            mirror_self=self.mirror is not None,
            size=parsed_size(self.size),
            lenient=self.lenient,
        )


def parsed_size(size: str | None) -> tuple[int, int] | None:
    """``"640x480"`` -> ``(640, 480)``.

    Raises:
        InputError: it is written in another way.
    """
    if size is None:
        return None
    numbers = SIZE.fullmatch(size)
    if numbers is None:
        raise InputError(f"--size {size}: expected WIDTHxHEIGHT, such as 768x512")
    return int(numbers[1]), int(numbers[2])


def parsed_settings(settings: list[str] | None) -> dict[str, object]:
    """Values of ``--set``: ``["resolution=256"]`` -> ``{"resolution": 256}``. What is no value of TOML is a word.

    Raises:
        InputError: a setting without ``=``, or a value beyond what a scene file may hold.
    """
    options: dict[str, object] = {}
    for setting in settings or []:
        name, equals, value = setting.partition("=")
        if not equals or not name.strip():
            raise InputError(f"--set {setting}: expected OPTION=VALUE")
        try:
            tables = parse_toml(f"value = {value}")
        except InputError as error:
            if not isinstance(error.__cause__, ValueError):  # not a word, but beyond the limits of any value
                raise error.within(f"--set {name}") from None
            tables = {}
        options[name.strip()] = tables["value"] if tables.keys() == {"value"} else value.strip()
    return options


def mesh_or_shape(name: str) -> Mesh:
    """The procedural shape called ``name``, or else the mesh file.

    Raises:
        InputError: there is neither, or the file cannot be read.
    """
    path = Path(name)
    if name in shapes.names() and not path.exists():
        return shapes.make(name)
    with suppress(OSError):  # a missing file: load_mesh says so
        check_regular(path, "a mesh file")
    return load_mesh(name)
