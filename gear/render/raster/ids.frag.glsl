flat in int id;
layout(location = 0) out int geom_id;

void main() { geom_id = id; }
