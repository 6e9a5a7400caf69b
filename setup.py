from setuptools import setup
setup(cffi_modules=["csrc/binding.py:builder"])
