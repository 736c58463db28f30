"""One self-contained HTML page for browsing a dataset: pictures, overlays, filters, histograms and maps."""
