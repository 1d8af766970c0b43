"""Predictor, inverse and workspace of the compiled rod, for control loops. Imports no JAX."""

from rodmodel.control._branches import LOADING as LOADING
from rodmodel.control._branches import Branch as Branch
from rodmodel.control._branches import Branches as Branches
from rodmodel.control._branches import BranchSolution as BranchSolution
from rodmodel.control._inverse import Inverse as Inverse
from rodmodel.control._inverse import inverse as inverse
from rodmodel.control._inverse import inverse_many as inverse_many
from rodmodel.control._inverse import inverse_of_rod as inverse_of_rod
from rodmodel.control._of_rod import core_of as core_of
from rodmodel.control._predictor import Prediction as Prediction
from rodmodel.control._predictor import Predictor as Predictor
from rodmodel.control._predictor import TipJacobian as TipJacobian
from rodmodel.control._workspace import Workspace as Workspace
from rodmodel.control._workspace import workspace as workspace
