"""Sweeps and laws of the section after partition walls have snapped to one side."""

from calibration.snapped.affine_law import AffineLaw as AffineLaw
from calibration.snapped.affine_law import as_network as as_network
from calibration.snapped.affine_law import fit_affine as fit_affine
from calibration.snapped.fit import SnappedFit as SnappedFit
from calibration.snapped.fit import fit_snapped as fit_snapped
from calibration.snapped.paths import snapped_paths as snapped_paths
from calibration.snapped.plan import SnappedPlan as SnappedPlan
from calibration.snapped.plan import sheet_domain as sheet_domain
from calibration.snapped.series import in_series as in_series
from calibration.snapped.sheet import SnappedSheet as SnappedSheet
from calibration.snapped.tracing import SnappedTracer as SnappedTracer
from calibration.snapped.tracing import snapped_state as snapped_state
