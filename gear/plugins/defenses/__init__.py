"""Built-in defenses, one file each; defenses that read activations share `activations`."""
