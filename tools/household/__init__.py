"""The baker of the household models: shapes, textures and materials by code, written as GLB with a catalogue."""
