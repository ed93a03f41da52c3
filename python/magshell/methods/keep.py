"""What a motion keeps for its gradients."""

from __future__ import annotations

from dataclasses import dataclass

from .._checks.scalars import not_negative
from .._machine.frozen import immutable

KINDS = ("stages", "checkpoints", "factors")


@immutable
@dataclass(frozen=True)
class Keep:
    """What a motion keeps for its gradients, and how much of it: `keep` of ms.simulate.

    what: "stages", all states; "checkpoints", between which the steps are taken again on the way back, some of them several
        times; "factors": all states with their factorizations, which pays where several gradients are taken of one motion.
        None: all states if they fit into the budget, else checkpoints. `keep="factors"` is short for ms.Keep("factors").
    memory_budget: bytes.

    >>> import magshell as ms
    >>> mesh = ms.meshes.rectangle(0.05, 0.01, cells=(4, 1))
    >>> sheet = ms.Shell(mesh, thickness=1e-3, young_modulus=1e6, mass_density=1e3)
    >>> scene = ms.Scene(sheet, supports=[ms.Clamp(mesh.edges_at(x=0.0))], gravity=(0, 0, -9.81))
    >>> ms.simulate(scene, steps=2, time_step=5e-3, keep=ms.Keep("checkpoints", memory_budget=1e6)).keep
    'nothing'
    """

    what: str | None = None
    memory_budget: float = 2e9

    def __post_init__(self) -> None:
        if self.what not in (None, *KINDS):
            raise ValueError(
                f'keep must be "stages", "checkpoints", "factors" or None, got {self.what!r:.60}'
            )
        object.__setattr__(self, "memory_budget", not_negative("memory_budget", "bytes", self.memory_budget))


def kept(keep: str | Keep | None) -> Keep:
    """What a caller hands in, as a Keep. Raises ValueError."""
    return keep if isinstance(keep, Keep) else Keep(keep)
