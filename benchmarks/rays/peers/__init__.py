"""Programs that answer the same questions as our ray tracer, one small module each."""
