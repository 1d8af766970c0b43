"""Effects of base and cap on the rod, fitted to runs of the full actuator."""

from calibration.ends.fit import PARAMETERS as PARAMETERS
from calibration.ends.fit import Compliance as Compliance
from calibration.ends.fit import Ends as Ends
from calibration.ends.fit import fit_compliance as fit_compliance
from calibration.ends.fit import fit_ends as fit_ends
from calibration.ends.fit import fit_shear as fit_shear
from calibration.ends.runs_for_layout import runs_for as runs_for
