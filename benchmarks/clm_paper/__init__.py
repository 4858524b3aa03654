"""The experiments of De Vincenti and Coros (section IV): runs over seeds, pictures, a report."""
