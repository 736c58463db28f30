// No colour: only the depth that OpenGL writes, for shadow maps.

void main() {}
