"""Who computes what, where: blocks of a plan on threads, processes and clusters."""
