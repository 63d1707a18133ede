"""Compare everything that drives here with recorded results of Nav2's own code."""
