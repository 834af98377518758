"""What an array gains beyond the papers: the covariance of its mean, comparisons of its IMUs, and who is left out."""
