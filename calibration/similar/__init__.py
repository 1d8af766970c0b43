"""Laws of one actuator for all that are similar to it."""

from calibration.similar.scale_fit import rescaled as rescaled
from calibration.similar.scaled import scaled as scaled
from fem_reference.design import Scale as Scale
