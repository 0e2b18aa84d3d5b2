"""What sets the wheels itself, at every reading: policies, what they are told, and the files that hold them."""

from hil.policies.driver import PolicyDriver
from hil.policies.observing import HIGH, LOW, NAMES, SCALE, Perception, scaled
from hil.policies.policy import Policy, PolicyError
from hil.policies.policy_file import PolicyFileError, is_policy, load_policy, policy_of, policy_text, save_policy

__all__ = [
    "HIGH",
    "LOW",
    "NAMES",
    "SCALE",
    "Perception",
    "Policy",
    "PolicyDriver",
    "PolicyError",
    "PolicyFileError",
    "is_policy",
    "load_policy",
    "policy_of",
    "policy_text",
    "save_policy",
    "scaled",
]
