// The number of the piece of geometry that covers each sample; ids and depth are ground truth.

flat in int id;
layout(location = 0) out int piece;

void main() { piece = id; }
