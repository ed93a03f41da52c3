"""The search for a magnetization that can be printed: found freely, pulled, rounded in blocks, exchanged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._input.arrays import count
from .._input.quantity import one_or_more, quantity
from .._input.scalars import not_negative
from .._input.tensors import detached, require_torch
from .._runtime.progress import progress_bar
from ..errors import Interrupted, ObjectiveFailed
from .ink import PrintableSet
from .jump_policies import checked_stateful
from .printable_checkpoint import PrintableCheckpoint
from .printable_minimum import PrintableMinimum, PrintableStage
from .printable_search import PrintableSearch, Stopped
from .printed_faces import PrintedFaces

if TYPE_CHECKING:
    from .._input.kinds import Numbers


def minimize_printable(
    objective: Callable[..., Any],
    remanent_magnetization: Numbers,
    ink: PrintableSet,
    *,
    max_iterations: int = 40,
    weights: Sequence[float] = (0.001, 0.003, 0.01),
    blocks: int = 10,
    stage_iterations: int = 15,
    exchanges: int = 60,
    tolerance: float = 1e-3,
    stateful: Sequence[Any] = (),
    callback: Callable[[PrintableStage], bool | None] | None = None,
    progress: bool = True,
    checkpoint: str | Path | None = None,
    resume: bool = False,
) -> PrintableMinimum:
    """Minimizes objective(remanent_magnetization) over what an ink can print.

    First any magnetization between those of the ink is free, for `max_iterations`. Then, for each of `weights`, the
    magnetization is pulled to what can be printed. Then faces are rounded in blocks, the surest first: those of a block are
    held at the nearest that can be printed (where the ink prints any share of its strength, only their direction is held),
    and the others are optimized again and make up for it. The blocks become smaller, as what is rounded last nobody makes
    up for. At last single faces are exchanged: the one of which the gradient promises most is changed, `exchanges` times,
    and the lowest design is kept. Never higher than the free design rounded at once, where that can be evaluated.

    objective: of a tensor (n_f, 3) A/m; returns a scalar tensor, or a dict of named terms whose sum it is. As in
        `ms.minimize` it may raise `ms.DesignRejected`; constraints are refused.
    remanent_magnetization: (n_f, 3) A/m, where to begin; brought into the box around what can be printed.
    ink: an `ms.PrintableSet`.
    weights: of the pull, without a unit and rising: 1 adds, at the free design, what it costs to round that at once.
        That is much; small ones leave the objective its say. () leaves the pull out.
    blocks: how many; 1 rounds all at once. stage_iterations: of the optimizer after each block and each weight.
    tolerance: a stage ends once the objective changed by no more than this share of itself, three times in a row.
    stateful: as in `ms.minimize`. A block whose equilibrium jumps is halved; a single face's jump is crossed if the
        objective or one of these, such as an `ms.WarmStart`, has accept_jumps().
    callback: called with the PrintableStage that each stage ends with; returning True ends the search there, with faces left
        that cannot be printed.
    progress: show a bar.
    checkpoint: a file that is replaced, whole or not at all, after each stage and each exchange; within a stage there is
        another one beside it, as of `ms.minimize`. resume: continue from it if it exists, with the same bits as without the
        stop, whatever remanent_magnetization is given then. A checkpoint of another ink, of other options or of another
        objective is refused (ValueError says what differs): its design is evaluated once and compared.

    Raises ValueError on bad input. Ctrl-C raises `ms.Interrupted`, an error on the way `ms.ObjectiveFailed`, once a design
    is known: both hold a PrintableMinimum in `last_good`, not all of which can be printed.

    >>> import magshell as ms
    >>> ink = ms.PrintableSet(1.0, [(1, 0, 0), (-1, 0, 0)], levels=(1,))
    >>> start = [(0.0, 0, 0)] * 3
    >>> found = ms.minimize_printable(lambda m: (m.sum() - 0.9) ** 2, start, ink, progress=False)
    >>> round(found.objective, 3), found.not_printable, sorted(found.directions.tolist())
    (0.01, 0, [0, 0, 1])
    """
    require_torch("minimize_printable")
    if not callable(objective):
        raise ValueError(f"objective must be a function of remanent_magnetization, got {objective!r:.60}")
    if not isinstance(ink, PrintableSet):
        raise ValueError(f"ink must be an ms.PrintableSet, got {type(ink).__name__}")
    start = quantity("remanent_magnetization", "A/m", detached(remanent_magnetization), ("n_f", 3))
    if len(start) == 0:
        raise ValueError("remanent_magnetization has no faces")
    ink.check_faces(len(start))
    weights = one_or_more("weights", "1", detached(weights), ("n",)).tolist()
    if any(weight < 0 for weight in weights):
        raise ValueError(f"weights must not be negative, got {weights}")
    max_iterations, stage_iterations, exchanges = (
        count(name, each, least=0)
        for name, each in (
            ("max_iterations", max_iterations),
            ("stage_iterations", stage_iterations),
            ("exchanges", exchanges),
        )
    )
    blocks, tolerance = count("blocks", blocks), not_negative("tolerance", "", tolerance)
    if callback is not None and not callable(callback):
        raise ValueError(f"callback must be a function of a PrintableStage, got {callback!r:.60}")
    if resume and checkpoint is None:
        raise ValueError("resume needs the checkpoint to continue from")
    faces, stateful = PrintedFaces(ink, start), checked_stateful(stateful)
    options = {
        "max_iterations": max_iterations,
        "weights": weights,
        "blocks": blocks,
        "stage_iterations": stage_iterations,
        "tolerance": tolerance,
    }
    kept = PrintableCheckpoint(checkpoint, ink, len(start), {**options, "exchanges": exchanges})
    bar = progress_bar("minimize_printable", 1 + len(weights) + blocks + exchanges, shown=progress)
    search = PrintableSearch(objective, faces, stateful, kept, callback, bar, **options)
    if resume and kept.there:
        search.resume()
    else:
        search.begin()
    try:
        with bar:
            return search.result(search.run(exchanges))
    except Stopped:
        return search.result("callback")
    except KeyboardInterrupt as error:
        raise Interrupted(
            "interrupted before all faces were rounded", search.result("interrupted")
        ) from error
    except Exception as error:
        if not search.history:
            raise
        raise ObjectiveFailed(
            f"the search failed before all faces were rounded: {error}\nThe design so far is in `error.last_good`.",
            search.result("failed"),
        ) from error
