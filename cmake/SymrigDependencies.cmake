# SPDX-License-Identifier: Apache-2.0
# The packages that libsymrig links. Read twice: by host/CMakeLists.txt, and, installed beside symrigConfig.cmake, by
# whoever calls find_package(symrig): a static library passes its private dependencies on to the final link.
include(CMakeFindDependencyMacro)

find_dependency(Threads)
find_dependency(Eigen3 3.4 NO_MODULE)
find_dependency(fmt)
find_dependency(TBB)
find_dependency(nlohmann_json)
find_dependency(OpenEXR)
find_dependency(PNG)
find_dependency(ZLIB)
find_dependency(OpenSSL COMPONENTS Crypto)
find_dependency(hwy)

# libusb and libdrm bring no CMake package, only a pkg-config file. HDF5 is found the same way, because CMake's FindHDF5 fails
# in a project whose only language is C++. Debian calls the serial library hdf5-serial, others call it hdf5.
find_dependency(PkgConfig)
if(NOT TARGET PkgConfig::SYMRIG_HDF5)
  pkg_search_module(SYMRIG_HDF5 REQUIRED IMPORTED_TARGET GLOBAL hdf5-serial hdf5)
endif()
if(NOT TARGET PkgConfig::LIBUSB)
  pkg_check_modules(LIBUSB REQUIRED IMPORTED_TARGET GLOBAL libusb-1.0)
endif()
if(NOT TARGET PkgConfig::LIBDRM)
  pkg_check_modules(LIBDRM REQUIRED IMPORTED_TARGET GLOBAL libdrm)
endif()
# Optional: GenICam cameras. SYMRIG_GENICAM is the option of the build, and the installed symrigConfig.cmake repeats it.
if(SYMRIG_GENICAM AND NOT TARGET PkgConfig::ARAVIS)
  pkg_check_modules(ARAVIS REQUIRED IMPORTED_TARGET GLOBAL aravis-0.8)
endif()
# Optional: DLP controllers, in the same way.
if(SYMRIG_DLPC AND NOT TARGET PkgConfig::HIDAPI)
  pkg_check_modules(HIDAPI REQUIRED IMPORTED_TARGET GLOBAL hidapi-hidraw)
endif()
