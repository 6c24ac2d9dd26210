"""Figure 3 as the paper has it, and the five blockages on one fragment, a column wide."""

from typing import Any

from experiments.figures.column_style import column_figure, grouped_bars, plain_ticks
from experiments.figures.loop_stages import STAGES, Case
from experiments.figures.loop_tables import PAPER_MS, Rows, spreads
from srt_jax import Solution
from srt_jax.instances.paper_blockers import BLOCKAGES

CAPTION = (
    "Path planning runtimes (PY16, Figure 3) on 500 x 500 fragments of cities: medians, whiskers"
    " are quartiles. The bands are the paper's ranges over the five blockages, in the colour of"
    " their stage."
)
MAPS_CAPTION = (
    "The five blockages on the first fragment (PY16 §4): what the search reaches before it gives"
    " up, the contour of what blocks, and the route once the blocker is gone."
)
_NAMES = {"JPS": "JPS", "A*": "A*", "obstacle": "obstacle detection"}
_PANELS = {
    "reference": "reference, plain Python",
    "C++": "the same in C++",
    "kernels": "batched kernels on JAX",
}


def figure3(rows: Rows, kernels: dict[str, Any]) -> Any:
    """Returns runtimes by blockage, a panel for each make there is."""
    makes = [make for make in _PANELS if make != "C++" or any(make in row for row in rows)]
    figure, axes = column_figure(
        len(makes), 1, height=1.45 * len(makes) + 0.45, sharex=True, sharey=True
    )
    for letter, panel, make in zip("abc", axes, makes):
        series = {_NAMES[stage]: spreads(rows, kernels, make, stage) for stage in STAGES}
        grouped_bars(panel, [blockage.capitalize() for blockage in BLOCKAGES], series, unit=1e3)
        for bar, stage in zip(panel.containers[::2], STAGES):
            panel.axhspan(
                *PAPER_MS[stage],
                color=bar.patches[0].get_facecolor(),
                alpha=0.22,
                linewidth=0,
                zorder=0,
            )
        panel.set_ylabel("runtime, ms")
        panel.set_title(f"{letter}  {_PANELS[make]}", loc="left")
    medians = [
        1e3 * one["median"]
        for make in makes
        for stage in STAGES
        for one in spreads(rows, kernels, make, stage)
    ]
    plain_ticks(axes[0], [*medians, *PAPER_MS["A*"]])
    handles, _ = axes[0].get_legend_handles_labels()
    band = axes[0].axhspan(1, 1, facecolor="0.8", linewidth=0, label="band: range in PY16")
    figure.legend(handles=[*handles, band], loc="outside lower center", ncols=2, frameon=False)
    return figure


def figure_of_maps(cases: list[Case], solutions: list[Solution]) -> Any:
    """Returns the five cases of one fragment beside each other, the legend in the sixth place."""
    from srt_jax.draw.parts.content import scene_of
    from srt_jax.draw.parts.legend import handles
    from srt_jax.draw.picture import draw_map

    scenes = [scene_of(case.task, solution) for case, solution in zip(cases, solutions)]
    figure, axes = column_figure(3, 2, height=5.35)
    for panel, case, scene in zip(axes.flat, cases, scenes):
        # patches of 2 x 2 cells: lines one cell thin can be seen
        draw_map(panel, scene, zoom=0.55, most_cells=250)
        panel.set_title(case.blockage.capitalize(), loc="left")
        panel.set_axis_off()
    last = axes.flat[-1]
    last.set_axis_off()
    last.legend(handles=handles(scenes), loc="center", frameon=False, title=cases[0].fragment)
    return figure
