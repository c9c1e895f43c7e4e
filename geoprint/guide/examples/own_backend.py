"""Judge a distance of your own.

Ways along edges are most people's first distance on a mesh. Registered as a backend they are measured as all others.
"""

from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

import geoprint
from geoprint.distance import isolines, level_distances
from geoprint.geometry import edge_lengths, edges
from geoprint.model import Contours, ScalarField


class AlongEdges:
    title = "shortest ways along edges"
    edge_length = staticmethod(lambda _part, *, spacing: spacing / 4)

    def __init__(self, surface):
        self.surface, count = surface, len(surface.vertices)
        self.ways = csr_array((edge_lengths(surface), edges(surface.faces).T), shape=(count, count))

    def distance(self, source):
        start = self.surface.faces[source.curves.points.faces][source.curves.points.weights > 0.99]
        return ScalarField(dijkstra(self.ways, directed=False, indices=start, min_only=True))

    def contours(self, source, *, spacing):
        field = self.distance(source)
        return Contours(*isolines(self.surface, field, levels=level_distances(field, spacing=spacing)), spacing, field)


geoprint.register_backend("edges", AlongEdges)
job = geoprint.job_of(surface="data/heart_flat_patch.ply", unit="mm", spacing=4.0, robot=False)
compared = geoprint.compare(job, backends=["edges", "heat"])
figure = compared.figure()
figure.set_size_inches(10.4, 5.2)
figure.savefig("own_backend.png", dpi=120)
print("thickness varies by", {key: f"{100 * plan.evenness.thickness.cv:.1f} %" for key, plan in compared.plans.items()})
# prints: thickness varies by {'edges': '2.3 %', 'heat': '0.5 %'}
