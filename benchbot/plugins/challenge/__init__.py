"""Challenges: teams hand in solutions, a queue runs them in places that nobody knows, a leaderboard can be verified."""

__all__: list[str] = []
