"""Pictures in the report page of a benchmark."""
