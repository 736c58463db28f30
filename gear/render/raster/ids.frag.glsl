flat in int id;
layout(location = 0) out int piece;

void main() { piece = id; }
