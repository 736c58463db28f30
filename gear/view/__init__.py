"""One HTML page of a dataset that opens from disk: pictures, overlays, filters, histograms and maps."""
