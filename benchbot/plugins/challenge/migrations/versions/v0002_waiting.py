"""An index of what waits of each team, for a queue that chooses a team before it looks for what is oldest."""

from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Make the index."""
    op.create_index("ix_submissions_waiting", "submissions", ["team", "state", "number"])
