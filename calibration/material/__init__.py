"""Fit of material laws to tests: machine files, candidates, choice by held-out error, report."""

from calibration.material.choice import FittedLaw as FittedLaw
from calibration.material.choice import MaterialFit as MaterialFit
from calibration.material.choice import MaterialFitError as MaterialFitError
from calibration.material.choice import fit_material as fit_material
from calibration.material.machine_file import MaterialTest as MaterialTest
from calibration.material.machine_file import MaterialTestError as MaterialTestError
from calibration.material.machine_file import Specimen as Specimen
from calibration.material.machine_file import read_material_test as read_material_test
from calibration.material.report import fit_record as fit_record
from calibration.material.report import fit_table as fit_table
from calibration.material.report import material_lines as material_lines
from calibration.material.report import material_table as material_table
