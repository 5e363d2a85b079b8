"""Alembic's environment: migrates over the connection that it is given."""

from alembic import context

from benchbot.plugins.challenge.tables import metadata

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=metadata,
    render_as_batch=True,
    transactional_ddl=True,
)
with context.begin_transaction():
    context.run_migrations()
