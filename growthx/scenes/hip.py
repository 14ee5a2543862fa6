"""What acts on the hip in daily life: the joint's force and muscles, in space and as shares of the body's weight.

Vectors are (lateral, anterior, superior).  The joint's forces are means of those measured in vivo by OrthoLoad's
instrumented implants (Bergmann et al. 2016, PLOS ONE 11:e0155612).  The muscles' places and directions are those of
upright standing of one cadaver (TLEM 2.0); how hard they pull is our own choice, in the order of published models.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from growthx.common.checks import require_each, require_name, require_number, require_vector
from growthx.common.errors import InputError, shown

Vector = tuple[float, float, float]


def _in_space(value: object, what: str) -> Vector:
    vector = require_vector(value, what)
    if len(vector) != 3:
        raise InputError(f"{what} is {shown(value)}: three numbers (lateral, anterior, superior) would be right")
    return vector[0], vector[1], vector[2]


@dataclass(frozen=True)
class Muscle:
    """A muscle, or a part of one, that pulls at the bone.

    force: % of body weight.  direction: in which it pulls the bone, of any length.  place: of its attachment, from the
    centre of the head, mm; it acts about the place of the boundary that is nearest to it.
    on: the boundary.  radius: of the attachment (mm).
    """

    name: str
    force: float
    direction: Vector
    place: Vector
    on: str = "trochanter"
    radius: float = 12.0

    def __post_init__(self) -> None:
        require_name(self.name, "the name of a muscle")
        require_name(self.on, f"the boundary of {self.name}")
        require_number(self.force, f"the force of {self.name} (% of body weight)", "a positive number", lambda f: f > 0)
        require_number(self.radius, f"the radius of {self.name} (mm)", "a positive number", lambda r: r > 0)
        for name in ("direction", "place"):
            object.__setattr__(self, name, _in_space(getattr(self, name), f"the {name} of {self.name}"))
        if not any(self.direction):
            raise InputError(f"the direction of {self.name} is {shown(self.direction)}: one of some length is due")

    @property
    def pull(self) -> Vector:
        """Its force as a vector, % of body weight."""
        x, y, z = self.force * np.array(self.direction) / np.linalg.norm(self.direction)
        return float(x), float(y), float(z)


@dataclass(frozen=True)
class Activity:
    """What a person does in a day, at its most strenuous moment.

    joint: force on the head, % of body weight.  muscles: that pull meanwhile.
    """

    name: str
    joint: Vector
    muscles: tuple[Muscle, ...] = ()

    def __post_init__(self) -> None:
        require_name(self.name, "the name of an activity")
        object.__setattr__(self, "joint", _in_space(self.joint, f"the joint force of {self.name}"))
        if not any(self.joint):
            raise InputError(f"the joint force of {self.name} is {shown(self.joint)}: one of some size would be right")
        muscles = require_each(self.muscles, Muscle, f"the muscles of {self.name}", "Muscle")
        object.__setattr__(self, "muscles", muscles)


def abductors(force: float) -> tuple[Muscle, ...]:
    """The abductors, which pull with so much together (% of body weight) as if they were parallel."""
    return (
        Muscle("gluteus medius, anterior", 0.5 * force, (-0.21, -0.12, 0.97), (62.0, 5.0, -7.0)),
        Muscle("gluteus medius, posterior", 0.25 * force, (-0.50, -0.29, 0.82), (58.0, -14.0, -3.0)),
        Muscle("gluteus minimus", 0.25 * force, (-0.35, 0.10, 0.93), (52.0, 17.0, -20.0)),
    )


ACTIVITIES = (
    Activity("walking", (67.7, -23.6, -235.8), abductors(130.0)),
    Activity("one-legged stance", (73.6, -15.0, -248.8), abductors(143.0)),
    Activity("standing up", (75.4, -20.1, -173.3), abductors(90.0)),
)
DAILY = (0.75, 0.2, 0.05)  # their parts of the day's cycles
