from .edge_velocity_estimator import EdgeVelocityEstimator as EdgeVelocityEstimator
from .motion import Motion as Motion
from .records import RecordWarning as RecordWarning
from .records import velocity as velocity
from .records import velocity_of_edges as velocity_of_edges
from .sampler import Sampler as Sampler
from .velocity_estimator import VelocityEstimator as VelocityEstimator
