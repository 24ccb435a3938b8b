"""One free segment of the strip in closed form: a piece of a pendulum's swing."""
