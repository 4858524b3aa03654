"""What is shown of a run: plots, pictures, videos, recordings and a live view."""
