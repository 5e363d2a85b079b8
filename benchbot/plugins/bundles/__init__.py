"""Results that others can trust: bundled with what made them, made again elsewhere, or replayed."""
