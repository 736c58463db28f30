"""Networks in torch: graphs, weights, and what runs them. Never imported by what collects."""
