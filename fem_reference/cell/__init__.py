"""The period cell: helical periodicity, equations, condensation."""

from fem_reference.cell.period_cell import CellError as CellError
from fem_reference.cell.period_cell import CellState as CellState
from fem_reference.cell.period_cell import Load as Load
from fem_reference.cell.period_cell import PeriodCell as PeriodCell
from fem_reference.cell.period_cell import follow as follow
