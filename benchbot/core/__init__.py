"""The core: contracts between plug-ins, and the logic that needs no web, terminal, renderer or ROS."""
