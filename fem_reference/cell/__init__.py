"""The period cell: helical periodicity, equations, condensation."""

from fem_reference.cell.load import Load as Load
from fem_reference.cell.period_cell import CellError as CellError
from fem_reference.cell.period_cell import CellState as CellState
from fem_reference.cell.period_cell import PeriodCell as PeriodCell
from fem_reference.cell.period_cell import follow as follow
from fem_reference.cell.stretch import extreme_stretches as extreme_stretches
from fem_reference.cell.stretch import largest_stretch as largest_stretch
from fem_reference.cell.stretch import stretch_beyond_tests as stretch_beyond_tests
