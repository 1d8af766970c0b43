"""Laws of one actuator for all that are similar to it."""

from calibration.similar.scaled import Scale as Scale
from calibration.similar.scaled import scaled as scaled
