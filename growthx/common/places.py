"""Where an error comes from, in a word that `growthx help` understands."""

from __future__ import annotations

from types import TracebackType

CHECKS = "growthx.common."  # what all call: who has called it tells more
TOLD = ("growthx.cli.program", "growthx.cli.machine.", "growthx.common.exits")  # say themselves where there is help
MAKING = ("__init__", "__post_init__")


def place_of(error: BaseException) -> str:
    """Module and public function or class that refuse, as 'model.loads.Traction'; empty where growthx does not.

    Of a check that all call it is the caller.

    Example:
        >>> from growthx.common.places import place_of
        >>> try:
        ...     gx.Material(young=-1.0)
        ... except gx.InputError as error:
        ...     print(place_of(error))
        constitutive.material.Material
    """
    frames = _frames(error.__traceback__)
    if not frames or not frames[-1][0].startswith("growthx."):
        return ""
    ours = [(module, _public(name)) for module, name in frames[::-1] if module.startswith("growthx.")]
    module = next((module for module, _ in ours if not module.startswith(CHECKS)), ours[0][0])
    if module.startswith(TOLD):
        return ""
    named = next((name for where, name in ours if where == module and name), [])
    return ".".join([module.removeprefix("growthx."), *named])


def _frames(traceback: TracebackType | None) -> list[tuple[str, str]]:
    """Module and name of each function that was at work, the innermost last; of a class that is made, its own."""
    frames = []
    while traceback is not None:
        frame = traceback.tb_frame
        module, name = frame.f_globals.get("__name__", ""), frame.f_code.co_qualname
        made = type(frame.f_locals.get("self"))
        if frame.f_code.co_name in MAKING and made.__module__.startswith("growthx."):
            module, name = made.__module__, made.__qualname__
        frames.append((module, name))
        traceback = traceback.tb_next
    return frames


def _public(name: str) -> list[str]:
    """The parts of a function's name down to the first that is nobody's but its module's."""
    parts = name.split(".")
    hidden = next((number for number, part in enumerate(parts) if part[0] in "_<"), len(parts))
    return parts[:hidden]
