"""QPs from files by our back end and by peers from PyPI: `palanquin bench qps`."""
