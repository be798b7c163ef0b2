"""Figure 1c and d: a neuron under constant input."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from drawing import style
from experiments.hysteresis import cycle
from experiments.verdict import Results


def constant_input(results: Results) -> Figure:
    """V over time under weak and strong input, and D over V under the strong one."""
    data = results["F1"]
    figure, grid = style.panels(1, 2, width=style.WIDE, height=2.5)
    left, right = grid[0]
    time = data["bin"].to_numpy()
    left.plot(time, data["V"].sel(input="super-threshold"), color=style.INK, lw=1.1,
              label="super-threshold input")  # fmt: skip
    left.plot(time, data["V"].sel(input="sub-threshold"), color=style.BLUE, lw=1.4, ls="--",
              label="sub-threshold input")  # fmt: skip
    left.axhline(1.0, color=style.GREY, lw=0.8, ls=":")
    left.annotate("threshold", (time[-1], 1.0), xytext=(2, 0), textcoords="offset points",
                  va="center", fontsize=6, color=style.GREY, annotation_clip=False)  # fmt: skip
    left.set(
        xlabel="time (bins)", ylabel="membrane potential V", xlim=(0, time[-1]), ylim=(-0.1, 1.45)
    )
    left.legend(loc="upper right", ncols=2)
    style.letter(left, "c")

    V, D = cycle(data)
    weak = data.sel(input="sub-threshold")
    right.plot(weak["V"], weak["D"], "--", color=style.BLUE, lw=1.4)
    right.plot(V, D, "-", color=style.INK, lw=1.0)
    right.plot(V, D, "o", color=style.INK, ms=2.2)
    for k in np.unique(np.linspace(1, len(V) - 2, 9).astype(int)):
        right.annotate(
            "", (V[k + 1], D[k + 1]), (V[k], D[k]),
            arrowprops={"arrowstyle": "-|>", "color": style.RED, "lw": 0.9, "mutation_scale": 9},
        )  # fmt: skip
    right.axvline(1.0, color=style.GREY, lw=0.8, ls=":")
    right.set(xlabel="membrane potential V", ylabel="decay D (per bin)")
    style.letter(right, "d")
    return figure
