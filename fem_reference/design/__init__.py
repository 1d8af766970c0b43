"""One actuator as a design: its parts, its file, and how it compares with another."""

from fem_reference.design.design import BONDS as BONDS
from fem_reference.design.design import DENSITY as DENSITY
from fem_reference.design.design import Design as Design
from fem_reference.design.design import refuse_unknown_bond as refuse_unknown_bond
from fem_reference.design.json_schema import design_schema as design_schema
from fem_reference.design.material_table import Silicone as Silicone
from fem_reference.design.picture import design_figure as design_figure
from fem_reference.design.read import DesignError as DesignError
from fem_reference.design.read import parse_design as parse_design
from fem_reference.design.read import read_design as read_design
from fem_reference.design.similarity import Scale as Scale
from fem_reference.design.similarity import Similarity as Similarity
from fem_reference.design.similarity import similarity as similarity
from fem_reference.design.write import design_text as design_text
