"""The full-length actuator: equations, loads, volume control, pose."""

from fem_reference.actuator.actuator import Actuator as Actuator
from fem_reference.actuator.actuator import ActuatorError as ActuatorError
from fem_reference.actuator.actuator import ActuatorState as ActuatorState
from fem_reference.actuator.actuator import Settled as Settled
from fem_reference.actuator.load import ActuatorLoad as ActuatorLoad
from fem_reference.actuator.model import Deformation as Deformation
from fem_reference.actuator.volume_control import VolumeState as VolumeState
