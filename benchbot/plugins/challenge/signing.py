"""Signed statements: who handed in which bytes, and which code scored them (DSSE 1.0, in-toto Statement v1, Ed25519).

A statement is JSON in a DSSE envelope: its subject is the submission's archive by SHA-256, its predicate says the rest.
"""

import base64
import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.core import atomic
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from securesystemslib.signer import CryptoSigner, SSlibKey

HEADER = "benchbot-statement"
"""The header of a request that carries a statement: an envelope as JSON in base64."""
PAYLOAD_TYPE = "application/vnd.in-toto+json"
STATEMENT_TYPE = "https://in-toto.io/Statement/v1"
SUBMISSION, SCORE = (f"urn:benchbot:challenge:{kind}:1" for kind in ("submission", "score"))
Document = dict[str, Any]


@dataclass(frozen=True)
class Key:
    """A private key in a file of its own."""

    signer: "CryptoSigner"

    @property
    def public(self) -> Document:
        """The public key, as it is published: `{keyid, keytype, scheme, keyval}`."""
        key = self.signer.public_key
        return {"keyid": key.keyid, **key.to_dict()}

    def sign(self, predicate_type: str, sha256: str, predicate: Mapping[str, Any]) -> Document:
        """Return the envelope of a statement about the submission that has this digest."""
        from securesystemslib.dsse import Envelope

        statement = {
            "_type": STATEMENT_TYPE,
            "subject": [{"name": "submission.zip", "digest": {"sha256": sha256}}],
            "predicateType": predicate_type,
            "predicate": dict(predicate),
        }
        payload = json.dumps(statement, sort_keys=True, allow_nan=False, separators=(",", ":")).encode()
        envelope = Envelope(payload, PAYLOAD_TYPE, {})
        envelope.sign(self.signer)
        document: Document = envelope.to_dict()
        return document

    def has_signed(self, envelope: Mapping[str, Any]) -> bool:
        """Say whether an envelope names this key as its signer; not whether the signature is right."""
        return any(signature.get("keyid") == self.public["keyid"] for signature in envelope["signatures"])


@dataclass(frozen=True)
class Statement:
    """The content of an envelope whose signature was right."""

    sha256: str
    predicate: Mapping[str, Any]
    digest: str
    """The SHA-256 of the signed payload: of equal ones only one counts."""


def make(path: Path) -> Key:
    """Make a key in a new file that only its owner may read; raises BenchbotError where there is one."""
    from securesystemslib.signer import CryptoSigner

    signer = CryptoSigner.generate_ed25519()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError as error:
        raise BenchbotError(
            f"There is a key in {path} already.",
            "What was signed with it could not be told to be its owner's any more.",
            "Use it, or name another file.",
        ) from error
    except OSError as error:
        raise atomic.cannot_write(path, error) from error
    with os.fdopen(handle, "wb") as file:
        file.write(signer.private_bytes)
        file.flush()
        os.fsync(file.fileno())
    return Key(signer)


def load(path: Path) -> Key:
    """Return the key in a file; raises BenchbotError when there is none."""
    from cryptography.hazmat.primitives.serialization import load_pem_private_key
    from securesystemslib.signer import CryptoSigner

    try:
        return Key(CryptoSigner(load_pem_private_key(path.read_bytes(), None)))
    except (OSError, ValueError, TypeError) as error:
        why = error.strerror if isinstance(error, OSError) else "The file holds no private key without a password."
        raise BenchbotError(f"There is no key in {path}.", str(why), f"Make one: benchbot key make {path}") from error


def public_key(document: Any) -> "SSlibKey":
    """Return a public key from its published form; raises BenchbotError for all but an Ed25519 key by its own id."""
    from securesystemslib.signer import SSlibKey

    try:
        given = dict(document)
        key = SSlibKey.from_dict(str(given.pop("keyid")), given)
        raw = bytes.fromhex(key.keyval["public"])
    except (KeyError, TypeError, ValueError) as error:
        raise _no_key(f"{type(error).__name__}: {error}") from error
    if key.keytype != "ed25519" or key.scheme != "ed25519" or len(raw) != 32 or key.unrecognized_fields:
        raise _no_key("It is of another kind.")
    if key.keyid != _key_id(key):
        raise _no_key("Its id is not the digest of the key.")
    return key


def opened(envelope: Any, key: "SSlibKey", predicate_type: str) -> Statement:
    """Return the statement in an envelope; raises BenchbotError unless this key has signed it, alone, for this."""
    from copy import deepcopy

    from securesystemslib.dsse import Envelope
    from securesystemslib.exceptions import UnverifiedSignatureError, VerificationError

    try:
        found = Envelope.from_dict(deepcopy(envelope))
        if set(found.signatures) != {key.keyid} or found.payload_type != PAYLOAD_TYPE:
            raise _not_signed("It is signed by another key than the one that is known.")
        found.verify([key], 1)
        statement = json.loads(found.payload)
        (subject,) = statement["subject"]
        digest, predicate = subject["digest"]["sha256"], statement["predicate"]
        if statement["_type"] != STATEMENT_TYPE or statement["predicateType"] != predicate_type:
            raise _not_signed("It states something else.")
    except (UnverifiedSignatureError, VerificationError) as error:
        raise _not_signed("Its signature is not that of its content.") from error
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise _not_signed("It has not the form of one.") from error
    if not isinstance(digest, str) or not isinstance(predicate, dict):
        raise _not_signed("It has not the form of one.")
    return Statement(digest, predicate, hashlib.sha256(found.payload).hexdigest())


def about(challenge: str, phase: str, team: str, image: str | None) -> Document:
    """Return what statements about a submission say of it alike; its image only where one was handed in."""
    return {"challenge": challenge, "phase": phase, "team": team, **({} if image is None else {"image": image})}


def is_about(predicate: Mapping[str, Any], expected: Mapping[str, Any]) -> bool:
    """Say whether a statement is about a submission and no other: what `about` returns, and no image besides."""
    return all(predicate.get(key) == value for key, value in {"image": None, **expected}.items())


def image_in(envelope: Mapping[str, Any]) -> str | None:
    """Return the digest of the image that a checked envelope is about, if it is about one."""
    image: str | None = json.loads(base64.b64decode(envelope["payload"]))["predicate"].get("image")
    return image


def digest(envelope: Mapping[str, Any]) -> str:
    """Return the SHA-256 of what an envelope holds: of statements with the same one only one counts."""
    return hashlib.sha256(base64.b64decode(envelope["payload"])).hexdigest()


def _key_id(key: "SSlibKey") -> str:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
    from securesystemslib.signer import SSlibKey

    return SSlibKey.from_crypto(Ed25519PublicKey.from_public_bytes(bytes.fromhex(key.keyval["public"]))).keyid


def _no_key(why: str) -> BenchbotError:
    return BenchbotError("This is no public key.", why, "Send what 'benchbot key show FILE' prints.")


def _not_signed(why: str) -> BenchbotError:
    return BenchbotError(
        "The statement is not signed as it must be.", why, "Sign it with the key that the team has joined with."
    )
