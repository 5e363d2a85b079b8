"""How the models are made: shapes, textures and materials by code, written as GLB with a catalogue."""
