"""Solves as functions of JAX, with gradients, jit and vmap: `ms.jax.equilibrium`.

JAX (the extra `jax`) is imported when one is called. It must compute in double precision, because stiffnesses and loads of
thin shells differ by many orders of magnitude:

    jax.config.update("jax_enable_x64", True)
"""

from .solves import JaxEquilibrium, equilibrium

__all__ = ["JaxEquilibrium", "equilibrium"]
