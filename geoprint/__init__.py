"""Plan evenly spaced print paths on curved surfaces and write the robot program that prints them.

Data flows one way, through frozen values (`geoprint.model`):

    file -> Surface -> [backend] -> Contours -> Toolpath -> PoseStream -> JointPath -> Trajectory
         -> Targets -> ControllerPath -> Clearance -> Orders -> Program

and imports run one way, to the right (braces: mutually independent; `lint-imports` checks it):

    cli -> pipeline -> {config, export, quality, report} -> {backends, deposition, paths, motion, robots}
        -> surfaces -> transforms -> model -> errors

`plan` runs every stage for one backend, `compare` for several on the same part, `save_plan` writes the result. The
stages themselves are public too: `surfaces.load` and `prepare`, `backends.BACKENDS`, `paths.arrange` and `poses`,
`motion.reach`, `retime`, `written_targets`, `controller_path` and `clearance`, `export.orders_of`, `rapid_program`,
`quality.uniformity`. Lengths are mm, times s, angles rad.

Sources, by the keys that docstrings use:

    [3MF]               3MF Consortium: 3D Manufacturing Format, core specification 1.3 and production extension 1.1.
    [ABBRapid]          ABB Robotics: RAPID reference manual. Data type zonedata; motion and I/O principles, positioning
                        during program execution.
    [Barequet1995]      Barequet, Sharir: Filling gaps in the boundary of a polyhedron. Comput. Aided Geom. Des. 12(2),
                        1995.
    [Bates1988]         Bates, Watts: Nonlinear regression analysis and its applications. 1988.
    [Bellman1957]       Bellman: Dynamic programming. Princeton University Press, 1957.
    [Blankenship1976]   Blankenship, Falk: Infinitely constrained optimization problems. J. Optim. Theory Appl. 19(2),
                        1976.
    [Bobenko2007]       Bobenko, Springborn: A discrete Laplace-Beltrami operator for simplicial surfaces. Discrete
                        Comput. Geom. 38(4), 2007.
    [Botsch2004]        Botsch, Kobbelt: A remeshing approach to multiresolution modeling. Symp. on Geometry Processing,
                        2004.
    [Brandstötter2014]  Brandstötter, Angerer, Hofbaur: An analytical solution of the inverse kinematics problem of
                        industrial serial manipulators with an ortho-parallel basis and a spherical wrist. 2014.
    [Chen1990]          Chen, Han: Shortest paths on a polyhedron. Proc. 6th Symp. on Computational Geometry, 1990.
    [Chhabra2008]       Chhabra, Richardson: Non-Newtonian flow and applied rheology. 2nd edition, 2008.
    [Cook1982]          Cook, Weisberg: Residuals and influence in regression. Chapman and Hall, 1982.
    [Crane2013]         Crane, Weischedel, Wardetzky: Geodesics in heat. ACM Trans. Graph. 32(5), 2013.
    [DeBoor1978]        De Boor: A practical guide to splines. Springer, 1978.
    [Desbrun1999]       Desbrun, Meyer, Schröder, Barr: Implicit fairing of irregular meshes using diffusion and
                        curvature flow. SIGGRAPH 1999.
    [Dey1999]           Dey, Edelsbrunner, Guha, Nekhayev: Topology preserving edge contraction. Publ. Inst. Math.
                        (Beograd) 66, 1999.
    [DICOM]             NEMA: Digital imaging and communications in medicine. PS3.3, information object definitions.
    [Dowell1971]        Dowell, Jarratt: A modified regula falsi method for computing the root of an equation. BIT 11,
                        1971.
    [Fitzpatrick2001]   Fitzpatrick, West: The distribution of target registration error in rigid-body point-based
                        registration. IEEE Trans. Med. Imaging 20(9), 2001.
    [Garland1997]       Garland, Heckbert: Surface simplification using quadric error metrics. SIGGRAPH 1997.
    [George1973]        George: Nested dissection of a regular finite element mesh. SIAM J. Numer. Anal. 10(2), 1973.
    [Guthe2005]         Guthe, Borodin, Klein: Fast and accurate Hausdorff distance calculation between meshes.
                        J. WSCG 13, 2005.
    [Hooke1961]         Hooke, Jeeves: "Direct search" solution of numerical and statistical problems. J. ACM 8(2),
                        1961.
    [Hoppe1992]         Hoppe, DeRose, Duchamp, McDonald, Stuetzle: Surface reconstruction from unorganized points.
                        SIGGRAPH 1992.
    [Huttenlocher1993]  Huttenlocher, Klanderman, Rucklidge: Comparing images using the Hausdorff distance. IEEE Trans.
                        Pattern Anal. Mach. Intell. 15(9), 1993.
    [Jacobson2013]      Jacobson, Kavan, Sorkine-Hornung: Robust inside-outside segmentation using generalized winding
                        numbers. ACM Trans. Graph. 32(4), 2013.
    [Kabsch1976]        Kabsch: A solution for the best rotation to relate two sets of vectors. Acta Cryst. A32, 1976.
    [Kahan2014]         Kahan: Miscalculating area and angles of a needle-like triangle. Lecture notes, Berkeley, 2014.
    [Kazhdan2013]       Kazhdan, Hoppe: Screened Poisson surface reconstruction. ACM Trans. Graph. 32(3), 2013.
    [Kimmel1998]        Kimmel, Sethian: Computing geodesic paths on manifolds. Proc. Natl. Acad. Sci. 95(15), 1998.
    [Lauterbach2009]    Lauterbach, Garland, Sengupta, Luebke, Manocha: Fast BVH construction on GPUs. Comput. Graph.
                        Forum 28(2), 2009.
    [Levy2002]          Lévy, Petitjean, Ray, Maillot: Least squares conformal maps. ACM Trans. Graph. 21(3), 2002.
    [Lorensen1987]      Lorensen, Cline: Marching cubes. Computer Graphics 21(4), 1987; here its planar form.
    [Mitchell1987]      Mitchell, Mount, Papadimitriou: The discrete geodesic problem. SIAM J. Comput. 16(4), 1987.
    [Mullen2008]        Mullen, Tong, Alliez, Desbrun: Spectral conformal parameterization. Comput. Graph. Forum 27(5),
                        2008.
    [Nakamura1986]      Nakamura, Hanafusa: Inverse kinematic solutions with singularity robustness for robot
                        manipulator control. J. Dyn. Syst. Meas. Control 108(3), 1986.
    [Pham2018]          Pham, Pham: A new approach to time-optimal path parameterization based on reachability analysis.
                        IEEE Trans. Robotics 34(3), 2018.
    [Polthier1998]      Polthier, Schmies: Straightest geodesics on polyhedral surfaces. Mathematical Visualization,
                        1998.
    [Rabinowitsch1929]  Rabinowitsch: Über die Viskosität und Elastizität von Solen. Z. Phys. Chem. A145, 1929.
    [Raya1990]          Raya, Udupa: Shape-based interpolation of multidimensional objects. IEEE Trans. Med. Imaging
                        9(1), 1990.
    [Satterthwaite1946] Satterthwaite: An approximate distribution of estimates of variance components. Biometrics
                        Bulletin 2(6), 1946.
    [Sharp2019]         Sharp, Soliman, Crane: Navigating intrinsic triangulations. ACM Trans. Graph. 38(4), 2019.
    [Surazhsky2005]     Surazhsky, Surazhsky, Kirsanov, Gortler, Hoppe: Fast exact and approximate geodesics on meshes.
                        ACM Trans. Graph. 24(3), 2005.
    [VanOosterom1983]   Van Oosterom, Strackee: The solid angle of a plane triangle. IEEE Trans. Biomed. Eng. 30(2),
                        1983.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from geoprint.config import job_of
    from geoprint.pipeline import compare, compare_parts, plan, save_comparisons, save_plan

__all__ = ["compare", "compare_parts", "job_of", "plan", "save_comparisons", "save_plan"]


def __getattr__(name: str) -> object:
    """Import the public functions when they are first used, so that `geoprint --help` answers at once."""
    if name == "job_of":
        from geoprint import config

        return config.job_of
    if name in __all__:
        from geoprint import pipeline

        return getattr(pipeline, name)
    raise AttributeError(f"module 'geoprint' has no attribute '{name}'")
