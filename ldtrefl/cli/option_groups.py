"""Options that belong together, as one parameter of a command.

A command takes a dataclass; on the command line each of its fields is an argument or option, as the field's type says.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from typing import get_type_hints


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose parameters of dataclasses are their fields. The names of all fields differ."""
    signature = inspect.signature(command, eval_str=True)
    groups = {
        name: parameter.annotation
        for name, parameter in signature.parameters.items()
        if isinstance(parameter.annotation, type) and dataclasses.is_dataclass(parameter.annotation)
    }
    expanded = [
        option
        for name, parameter in signature.parameters.items()
        for option in (_options_of(groups[name]) if name in groups else [parameter])
    ]

    def run(**given: object) -> None:
        made = {}
        for name, kind in groups.items():
            made[name] = kind(**{option: given.pop(option) for option in inspect.signature(kind).parameters})
        command(**made, **given)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    by_name = [option.replace(kind=inspect.Parameter.KEYWORD_ONLY) for option in expanded]
    run.__signature__ = signature.replace(parameters=by_name)  # type: ignore[attr-defined]
    return run


def _options_of(kind: type) -> list[inspect.Parameter]:
    """The fields of a dataclass as parameters."""
    hints = get_type_hints(kind, include_extras=True)
    parameters = inspect.signature(kind).parameters.values()
    return [parameter.replace(annotation=hints[parameter.name]) for parameter in parameters]
