"""Policy files: what was learnt by driving (`*.json`). They are data, and nothing in them is run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from firmware_protocol.errors import HilError
from hil.doors import Document, Door
from hil.files.documents import document_text, save_document
from hil.policies.policy import FORMAT, Policy, PolicyError

if TYPE_CHECKING:
    from pathlib import Path


class PolicyFileError(HilError):
    """A policy file can't be read, or a field of it is wrong; the text names the file, the line and the field."""


DOOR: Final = Door("policy file", PolicyFileError, largest=1 << 20)
"""The largest network takes 150 kB."""


def policy_text(policy: Policy) -> str:
    """A policy as a file holds it, in JSON.

    Args:
        policy: What was learnt.
    """
    return document_text(policy.to_dict(), "", as_json=True)


def save_policy(policy: Policy, path: Path, *, overwrite: bool = False) -> None:
    """Write a policy file, whole or not at all.

    Args:
        policy: What was learnt.
        path: Where to; `.json` is how files of this kind end.
        overwrite: One that exists is replaced.

    Raises:
        OutputExistsError: There is one, and it may not be replaced.
        PolicyFileError: It can't be written.
    """
    save_document(policy.to_dict(), "", path, PolicyFileError, overwrite=overwrite)


def policy_of(data: bytes) -> Policy:
    """The policy that JSON holds, as a file or a log has it.

    Args:
        data: The JSON.

    Raises:
        PolicyFileError: It is none.
    """
    return _policy(DOOR.document_of(data, "the policy", json=True))


def load_policy(path: Path) -> Policy:
    """Read and validate a policy file.

    Args:
        path: The file.

    Raises:
        PolicyFileError: It can't be read, is no JSON, or a field is missing, unknown or wrong.
    """
    return _policy(DOOR.document(path, json=True))


def is_policy(path: Path) -> bool:
    """Whether a file says of itself that it is a policy: an advice may be JSON as well.

    Args:
        path: The file.

    Raises:
        PolicyFileError: It ends in `.json`, and can't be read as JSON.
    """
    if path.suffix != ".json" or not path.is_file():
        return False
    data = DOOR.document(path, json=True).data
    return isinstance(data, dict) and data.get("format") == FORMAT


def _policy(document: Document) -> Policy:
    try:
        return Policy.from_dict(document.data)
    except PolicyError as error:
        raise document.wrong(error.path, str(error)) from error
