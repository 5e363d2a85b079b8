"""The migrations of a challenge's database, by Alembic."""
