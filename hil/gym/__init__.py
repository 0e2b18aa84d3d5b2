"""The emulated robot as an environment of Gymnasium: `pip install 'junior-hil[gym]'`.

env = gymnasium.make("hil.gym:junior_hil/Sumo-v0", opponent="flat-heavy")
envs = gymnasium.make_vec("hil.gym:junior_hil/Sumo-v0", num_envs=64, vectorization_mode="vector_entry_point")

JuniorEnv          one robot
JuniorVectorEnv    many, each in a ring of its own
"""

from hil.gym.environment import JuniorEnv
from hil.gym.registration import ENVIRONMENT, register
from hil.gym.vector import JuniorVectorEnv

register()

__all__ = ["ENVIRONMENT", "JuniorEnv", "JuniorVectorEnv", "register"]
