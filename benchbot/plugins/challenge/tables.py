"""The tables of a challenge's database. Times are seconds since the epoch, UTC; documents are JSON.

Tokens are 256 random bits and kept as SHA-256 alone: nothing in the database, or in its backup, lets anybody in.
"""

from sqlalchemy import JSON, BigInteger, Column, Float, ForeignKey, Index, Integer, MetaData, String, Table, Text

metadata = MetaData(
    naming_convention={
        "ix": "ix_%(column_0_label)s",
        "uq": "uq_%(table_name)s_%(column_0_name)s",
        "fk": "fk_%(table_name)s_%(column_0_name)s",
        "pk": "pk_%(table_name)s",
    }
)

teams = Table(
    "teams",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("name", String(60), nullable=False),
    Column("folded", String(200), nullable=False, unique=True),  # no two names that look alike
    Column("token", String(64), nullable=False, unique=True),
    Column("key", JSON),  # the public key that its submissions are signed with
    Column("baseline", Integer, nullable=False, default=0),
    Column("blocked", Text),  # why it may not submit
    Column("joined_at", Float, nullable=False),
    Column("running", Integer, nullable=False, default=0),
    Column("served_at", Float, nullable=False, default=0.0),
)
invitations = Table(
    "invitations",
    metadata,
    Column("token", String(64), primary_key=True),
    Column("note", String(200), nullable=False, default=""),
    Column("made_at", Float, nullable=False),
    Column("team", Integer, ForeignKey("teams.id")),
)
sessions = Table(
    "sessions",
    metadata,
    Column("token", String(64), primary_key=True),
    Column("team", Integer, ForeignKey("teams.id")),  # none: the organiser
    Column("expires_at", Float, nullable=False),
)
submissions = Table(
    "submissions",
    metadata,
    Column("id", String(32), primary_key=True),
    Column("number", Integer, nullable=False, unique=True),  # in the order in which they were accepted
    Column("team", Integer, ForeignKey("teams.id"), nullable=False, index=True),
    Column("phase", String(31), nullable=False),
    Column("title", String(120), nullable=False, default=""),
    Column("mode", String(10), nullable=False),
    Column("sha256", String(64), nullable=False),
    Column("size_bytes", BigInteger, nullable=False),
    Column("received_at", Float, nullable=False),
    Column("statement", String(64), nullable=False, unique=True),  # SHA-256 of the payload: none counts twice
    Column("envelope", JSON, nullable=False),
    Column("state", String(12), nullable=False),
    Column("reason", Text, nullable=False, default=""),
    Column("attempt", Integer, nullable=False, default=0),
    Column("failures", Integer, nullable=False, default=0),
    Column("worker", String(200), nullable=False, default=""),
    Column("lease_until", Float, nullable=False, default=0.0),
    Column("ended_at", Float),
    Index("ix_submissions_queue", "state", "number"),
    Index("ix_submissions_waiting", "team", "state", "number"),
    Index("ix_submissions_counted", "team", "phase", "received_at"),
)
scores = Table(
    "scores",
    metadata,
    Column("submission", String(32), ForeignKey("submissions.id"), primary_key=True),
    Column("phase", String(31), nullable=False, index=True),
    Column("score", Float, nullable=False),
    Column("document", JSON, nullable=False),
    Column("envelope", JSON, nullable=False),
    Column("scored_at", Float, nullable=False),
)
events = Table(
    "events",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("at", Float, nullable=False),
    Column("actor", String(200), nullable=False),
    Column("action", String(40), nullable=False),
    Column("submission", String(32), index=True),
    Column("team", Integer),
    Column("detail", Text, nullable=False, default=""),
)
settings = Table(
    "settings", metadata, Column("name", String(40), primary_key=True), Column("value", Text, nullable=False)
)
