"""The central rod: spline, coordinates along it, contact and bond with the cavity."""

from fem_reference.central_rod.barrier import ACTIVATION as ACTIVATION
from fem_reference.central_rod.barrier import INSIDE_SHARE as INSIDE_SHARE
from fem_reference.central_rod.barrier import PRESSED as PRESSED
from fem_reference.central_rod.barrier import REST_SHARE as REST_SHARE
from fem_reference.central_rod.barrier import barrier as barrier
from fem_reference.central_rod.bond import CoreBond as CoreBond
from fem_reference.central_rod.contact import CoreContact as CoreContact
from fem_reference.central_rod.rod_coordinates import CoreCoordinates as CoreCoordinates
from fem_reference.central_rod.spline_rod import CoreSpline as CoreSpline
from fem_reference.central_rod.spline_rod import SplineBasis as SplineBasis
