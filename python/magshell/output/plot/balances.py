"""The picture of a balance: energies, work, losses and the rest over the states of a path or a motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..._runtime.mixins import register_method
from .picture import Picture

if TYPE_CHECKING:
    from ...solve.statics.balance import EnergyBalance


@register_method
def plot_balance(balance: EnergyBalance) -> Picture:
    """Draw the rows of a balance as changes since the first state, the rest in black (needs the package matplotlib)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.8), layout="constrained")
    (above, below) = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    rows = [(name, row - row[0], "-") for name, row in balance.energies.items()]
    rows += [(f"work of {name}", row, "--") for name, row in balance.work.items()]
    rows += [(f"lost to {name}", row, ":") for name, row in balance.dissipation.items()]
    for name, row, style in rows:
        above.plot(balance.parameters, row, style, label=name)
    above.plot(balance.parameters, balance.rest, "k", label="rest")
    above.set_ylabel("change [J]")
    above.legend(frameon=False, fontsize="small")
    below.plot(balance.parameters, balance.rest, "k")
    below.set_ylabel("rest [J]")
    below.set_xlabel(balance._coordinate)
    for axes in (above, below):
        axes.spines[["top", "right"]].set_visible(False)
    return Picture(figure)
