"""Results as text, JSON and pictures. Only the pictures import matplotlib, at their first use."""

from typing import TYPE_CHECKING, Any

from rodmodel.view.cycle import cycle_record as cycle_record
from rodmodel.view.cycle import cycle_text as cycle_text
from rodmodel.view.text import inverse_record as inverse_record
from rodmodel.view.text import inverse_text as inverse_text
from rodmodel.view.text import prediction_record as prediction_record
from rodmodel.view.text import prediction_text as prediction_text
from rodmodel.view.text import workspace_record as workspace_record
from rodmodel.view.text import workspace_text as workspace_text

if TYPE_CHECKING:
    from rodmodel.view.cycle_plot import changes_side as changes_side
    from rodmodel.view.cycle_plot import draw_cycle as draw_cycle
    from rodmodel.view.cycle_plot import plot_cycle as plot_cycle
    from rodmodel.view.rod_plot import plot_rod as plot_rod
    from rodmodel.view.workspace_plot import plot_workspace as plot_workspace


def __getattr__(name: str) -> Any:
    if name == "plot_rod":
        from rodmodel.view.rod_plot import plot_rod

        return plot_rod
    if name in ("changes_side", "draw_cycle", "plot_cycle"):
        from rodmodel.view import cycle_plot

        return getattr(cycle_plot, name)
    if name == "plot_workspace":
        from rodmodel.view.workspace_plot import plot_workspace

        return plot_workspace
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
