"""Material laws: energy, stress and tangent, homogeneous deformation, stability, published silicones."""

from fem_reference.materials.homogeneous import MODES as MODES
from fem_reference.materials.homogeneous import drucker_matrix as drucker_matrix
from fem_reference.materials.homogeneous import first_instability as first_instability
from fem_reference.materials.homogeneous import nominal_stress as nominal_stress
from fem_reference.materials.homogeneous import principal_stretches as principal_stretches
from fem_reference.materials.homogeneous import true_stress as true_stress
from fem_reference.materials.library import SILICONES as SILICONES
from fem_reference.materials.library import PublishedSilicone as PublishedSilicone
from fem_reference.materials.library import published_silicone as published_silicone
from fem_reference.materials.material import Isochoric as Isochoric
from fem_reference.materials.material import Material as Material
from fem_reference.materials.ogden import Ogden as Ogden
from fem_reference.materials.ogden import mooney_rivlin as mooney_rivlin
from fem_reference.materials.ogden import neo_hookean as neo_hookean
from fem_reference.materials.principal_frame import BLOCKS as BLOCKS
from fem_reference.materials.principal_frame import DyadModuli as DyadModuli
from fem_reference.materials.principal_frame import Principal as Principal
from fem_reference.materials.principal_frame import dot as dot
from fem_reference.materials.principal_frame import half_turned as half_turned
from fem_reference.materials.principal_frame import materialised as materialised
from fem_reference.materials.principal_frame import pressure_moduli as pressure_moduli
from fem_reference.materials.principal_frame import principal as principal
from fem_reference.materials.yeoh import Yeoh as Yeoh
