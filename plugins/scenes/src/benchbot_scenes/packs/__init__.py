"""Asset packs that users install: fetched, converted and kept in their data folder. See docs/assets.md."""
