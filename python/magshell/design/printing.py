"""Search for a printable magnetization: a free one first, then a penalty, rounding in blocks, and exchanges of faces."""

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
from .jump_policies import checked_stateful
from .printable_minimum import PrintableMinimum, PrintableStage
from .printable_search import PrintableCheckpoint, PrintableSearch, Stopped
from .printable_set import PrintableSet
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
    """Minimize objective(remanent_magnetization) over the magnetizations that an ink can print.

    The search has four kinds of stages:

    - free: any magnetization between those of the ink is allowed, for `max_iterations`;
    - weight: for each of `weights`, a penalty pulls the magnetization towards printable ones;
    - hold: faces are rounded in blocks, those nearest to a printable magnetization first. The faces of a block are held
      there (if the ink prints any share of its strength, only their direction is held), and the others are optimized
      again to compensate. The blocks become smaller, because less and less is left to compensate with;
    - exchange: the face whose change the gradient predicts to gain most is changed, `exchanges` times (a tabu search).

    The lowest design is returned. It is never higher than the free design rounded at once, if that can be evaluated.

    objective: of a tensor (n_f, 3) A/m; returns a scalar tensor, or a dict of named terms whose sum it is. As in
        `ms.minimize` it may raise `ms.DesignRejected`; constraints are refused.
    remanent_magnetization: (n_f, 3) A/m, the start; clipped to the box around all printable magnetizations.
    ink: an `ms.PrintableSet`.
    weights: weights of the penalty, dimensionless and rising: 1 adds, at the free design, the cost of rounding it at
        once. That is much; with small weights the objective still matters. () omits the penalty.
    blocks: number of blocks; 1 rounds all faces at once. stage_iterations: largest number of iterations of the
        optimizer after each block and each weight.
    tolerance: a stage ends once the objective changed by no more than this share of itself, three times in a row.
    stateful: as in `ms.minimize`. A block whose equilibrium jumps is halved; a single face's jump is crossed if the
        objective or one of these, such as an `ms.WarmStart`, has accept_jumps().
    callback: called with the PrintableStage that each stage ends with; returning True ends the search there, with faces left
        that cannot be printed.
    progress: show a bar.
    checkpoint: a file that is replaced atomically after each stage and each exchange; within a stage there is a second
        one in the same folder, that of `ms.minimize`. resume: continue from it if it exists, with the same bits as without
        the stop; remanent_magnetization is then ignored. A checkpoint of another ink, of other options or of another
        objective is refused (ValueError says what differs): its design is evaluated once and compared.

    Raises ValueError on bad input. Ctrl-C raises `ms.Interrupted`, any other error `ms.ObjectiveFailed`, once a design
    is known: both hold a PrintableMinimum in `last_good`, with faces that cannot be printed.

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
    file = PrintableCheckpoint(checkpoint, ink, len(start), {**options, "exchanges": exchanges})
    bar = progress_bar("minimize_printable", 1 + len(weights) + blocks + exchanges, shown=progress)
    search = PrintableSearch(objective, faces, stateful, file, callback, bar, **options)
    if resume and file.there:
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
