"""Input traces of any filter: steps, sweep, noise and the worst cases of its proof."""
