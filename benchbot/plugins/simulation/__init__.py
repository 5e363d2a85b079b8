"""All of a simulator but its pictures, rays and the distance to its obstacles. Public as `benchbot.simulation`."""
