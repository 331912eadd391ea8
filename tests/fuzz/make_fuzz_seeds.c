/* make_fuzz_seeds DIR: writes small valid files for every harness to DIR/PARSER/NAME, with the library's own
 * writers. */
#include "geometry/fibers/fiber_set.h"
#include "geometry/phantom/phantom.h"
#include "geometry/volume/format/vol_file.h"
#include "optimizer/tools/simulated_camera/dng_file.h"
#include "renderer/image/image.h"
#include "tests/support/camera_files.h"
#include "tests/support/rgl_bytes.h"

#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <zlib.h>

static const char *root;

static const char *seed_path(const char *parser, const char *name)
{
    static char path[2][1024];
    static int turn;
    char *p = path[turn = 1 - turn];
    snprintf(p, sizeof path[0], "%s/%s", root, parser);
    mkdir(p, 0777);
    snprintf(p, sizeof path[0], "%s/%s/%s", root, parser, name);
    return p;
}

static void must(bool ok, const char *what)
{
    if (ok) return;
    fprintf(stderr, "make_fuzz_seeds: cannot write %s\n", what);
    exit(1);
}

static void put(const char *parser, const char *name, const char *text, const void *data, size_t n_data)
{
    FILE *file = fopen(seed_path(parser, name), "wb");
    must(file != NULL && fwrite(text, 1, strlen(text), file) == strlen(text) && fwrite(data, 1, n_data, file) == n_data,
         name);
    must(fclose(file) == 0, name);
}

static void volume_seeds(void)
{
    static const size_t n[3] = {6, 5, 4};
    static const double voxel[3] = {2e-6, 2e-6, 2e-6};
    struct volume v;
    struct direction_volume d;
    must(volume_init(&v, n, voxel, NULL) == STATUS_OK && direction_volume_init(&d, n, voxel, NULL) == STATUS_OK,
         "memory");
    for (size_t i = 0; i < volume_n_voxel(n); i++) v.density[i] = (float)(i % 7) / 7.0f;
    struct phantom_file_option o;
    phantom_file_option_default(&o);
    must(phantom_write_tiff(&v, &o, seed_path("tiff", "u16-deflate.tif"), NULL) == STATUS_OK, "TIFF");
    o.bits = 8;
    o.void_value = 10.0;
    o.fiber_value = 200.0;
    o.deflate = false;
    must(phantom_write_tiff(&v, &o, seed_path("tiff", "u8.tif"), NULL) == STATUS_OK, "TIFF");
    must(vol_write_density(seed_path("vol", "f32.vol"), &v, VOL_FLOAT32, NULL) == STATUS_OK, ".vol");
    must(vol_write_density(seed_path("vol", "u8.vol"), &v, VOL_UINT8, NULL) == STATUS_OK, ".vol");
    must(vol_write_direction(seed_path("vol", "direction.vol"), &d, VOL_QUANTISED, NULL) == STATUS_OK, ".vol");
    volume_release(&v);
    direction_volume_release(&d);
}

/* Arrays of NumPy, and NIfTI-1 with a sform. */
static void array_seeds(const uint8_t data[120])
{
    static const char text[] = "{'descr': '<u2', 'fortran_order': False, 'shape': (4, 3, 5), }         \n",
                      turned[] = "{'descr': '|u1', 'fortran_order': True, 'shape': (4, 5, 6), }         \n";
    uint8_t file[10 + sizeof text + 120] = "\x93NUMPY\1", nifti[352 + 120] = {0x5c, 1};
    const float pixdim[4] = {1, 2, 2, 2}, offset = 352, scale[2] = {2, 1}, srow[12] = {2, 0, 0, 0, 0, 0, 2, 0, 0, 2};
    const int16_t size[5] = {4, 6, 5, 4, 1}, type = 2, form = 1;
    for (int k = 0; k < 2; k++) {
        const size_t n = k == 0 ? sizeof text - 1 : sizeof turned - 1;
        file[8] = (uint8_t)n;
        memcpy(file + 10, k == 0 ? text : turned, n);
        memcpy(file + 10 + n, data, 120);
        put("npy", k == 0 ? "u16.npy" : "u8-fortran.npy", "", file, 10 + n + 120);
    }
    memcpy(nifti + 40, size, sizeof size);
    memcpy(nifti + 70, &type, sizeof type);
    memcpy(nifti + 76, pixdim, sizeof pixdim);
    memcpy(nifti + 108, &offset, sizeof offset);
    memcpy(nifti + 112, scale, sizeof scale);
    nifti[123] = 3;
    memcpy(nifti + 254, &form, sizeof form);
    memcpy(nifti + 280, srow, sizeof srow);
    memcpy(nifti + 344, "n+1", 4);
    memcpy(nifti + 352, data, 120);
    put("nifti", "u8.nii", "", nifti, sizeof nifti);
}

/* A slice of DICOM in explicit little-endian, 6 x 5 pixels of 16 bits, with two frames. */
static void dicom_seed(const uint8_t data[120])
{
    static const char element[] = "\x02\0\x10\0UI\x14\0"
                                  "1.2.840.10008.1.2.1\0"
                                  "\x20\0\x32\0DS\x06\0"
                                  "0\\0\\0 "
                                  "\x20\0\x37\0DS\x0c\0"
                                  "1\\0\\0\\0\\1\\0 "
                                  "\x28\0\x02\0US\x02\0\x01\0"
                                  "\x28\0\x04\0CS\x0c\0MONOCHROME2 "
                                  "\x28\0\x08\0IS\x02\0"
                                  "2 "
                                  "\x28\0\x10\0US\x02\0\x05\0"
                                  "\x28\0\x11\0US\x02\0\x06\0"
                                  "\x28\0\x30\0DS\x04\0"
                                  "2\\2 "
                                  "\x28\0\x00\1US\x02\0\x10\0"
                                  "\x28\0\x01\1US\x02\0\x0c\0"
                                  "\x28\0\x02\1US\x02\0\x0b\0"
                                  "\x28\0\x03\1US\x02\0\x01\0"
                                  "\xe0\x7f\x10\0OW\0\0\x78\0\0";
    uint8_t file[132 + sizeof element + 120] = {0};
    memcpy(file + 128, "DICM", 4);
    memcpy(file + 132, element, sizeof element);
    memcpy(file + 132 + sizeof element, data, 120);
    put("dicom", "two-frames.dcm", "", file, sizeof file);
}

/* A data set of HDF5 in deflated chunks. */
static void hdf5_seed(const uint8_t data[120])
{
    static const hsize_t size[3] = {4, 5, 6}, chunk[3] = {2, 3, 4};
    const hid_t file = H5Fcreate(seed_path("hdf5", "u8z.h5"), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t plan = H5Pcreate(H5P_DATASET_CREATE), space = H5Screate_simple(3, size, NULL);
    H5Pset_chunk(plan, 3, chunk);
    H5Pset_shuffle(plan);
    H5Pset_deflate(plan, 6);
    const hid_t set = H5Dcreate2(file, "scan", H5T_STD_U8LE, space, H5P_DEFAULT, plan, H5P_DEFAULT);
    must(H5Dwrite(set, H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0, "HDF5");
    H5Dclose(set);
    H5Sclose(space);
    H5Pclose(plan);
    must(H5Fclose(file) >= 0, "HDF5");
}

static void header_seeds(void)
{
    uint8_t data[120], packed[256];
    uLongf n_packed = sizeof packed;
    for (size_t i = 0; i < sizeof data; i++) data[i] = (uint8_t)(i * 3);
    must(compress(packed, &n_packed, data, sizeof data) == Z_OK, "zlib");
    put("metaimage", "u8.mha",
        "ObjectType = Image\nNDims = 3\nDimSize = 6 5 4\nElementSpacing = 0.002 0.002 0.002\nElementType = "
        "MET_UCHAR\nElementDataFile = LOCAL\n",
        data, 120);
    put("metaimage", "u16z.mha",
        "NDims = 3\nDimSize = 5 4 3\nElementType = MET_USHORT\nElementByteOrderMSB = True\nCompressedData = "
        "True\nElementDataFile = LOCAL\n",
        packed, n_packed);
    put("nrrd", "u8.nrrd",
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 6 5 4\nencoding: raw\nspacings: 0.002 0.002 0.002\n\n", data, 120);
    put("nrrd", "f32.nrrd",
        "NRRD0005\n# c\ntype: float\ndimension: 3\nsizes: 5 3 2\nendian: big\nencoding: raw\nspace: "
        "left-posterior-superior\nspace directions: (2,0,0) (0,2,0) (0,0,2)\nspace units: \"um\" \"um\" \"um\"\n\n",
        data, 120);
    put("nrrd", "u16z.nrrd",
        "NRRD0004\ntype: ushort\ndimension: 3\nsizes: 5 4 2\nendian: little\nencoding: gzip\nbyte skip: 40\nline skip: "
        "1\n\nline\n",
        packed, n_packed);
    array_seeds(data);
    dicom_seed(data);
    hdf5_seed(data);
    put("raw", "u8", "\x06\x05\x04", "\0\0\0", 3);
    uint8_t raw[126] = {5, 4, 3, 1, 2, 0};
    memcpy(raw + 6, data, 120);
    put("raw", "u16", "", raw, sizeof raw);
    put("measurements", "table.csv",
        "# "
        "c\nset,index,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b,r_se,g_se,"
        "b_se,weight,name\nfit,0,20,0,20,180,0,0.0222,0.0247,0.0564,0,0,0,1,a\nheld-out,1,60,0,60,90,90,0.0187,0.0201,"
        "0.0467,1e-3,1e-3,1e-3,2,b\n",
        "", 0);
}

static void fiber_seeds(void)
{
    static const float mitsuba[] = {INFINITY, 0, 0, 1, 0, 1, 1};
    uint8_t binary[15 + sizeof mitsuba] = "BINARY_HAIR\2"; /* two points */
    memcpy(binary + 15, mitsuba, sizeof mitsuba);
    put("hair", "mitsuba.hair", "", binary, sizeof binary);
    put("wif", "twill.wif",
        "[WIF]\nVersion=1.1\n[WEAVING]\nShafts=4\nTreadles=4\nRising Shed=yes\n[WARP]\nThreads=4\n[WEFT]\nThreads=4\n"
        "[THREADING]\n1=1\n2=2\n3=3\n4=4\n[TIEUP]\n1=1,2\n2=2,3\n3=3,4\n4=4,1\n[TREADLING]\n1=1\n2=2\n3=3\n4=4\n",
        "", 0);
    put("wif", "plan.wif", "[wif]\n[threading]\n1=1\n2=2\n[liftplan]\n1=1\n2=2\n[warp colors]\n1=3\n", "", 0);
    put("obj", "square.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\nf 1/1 2/2 3/3 4/4\nf -4/-4 -2/-2/1 "
        "-1/-1\n",
        "", 0);
    put("yarn_file", "yarn.txt",
        "ply_num: 3\nfiber_num: 12\naabb_min: [-1,-1,-1]\n\nyarn_clock_wise: 0\nfiber_clock_wise: 1\nyarn_alpha: "
        "0.45\nalpha: 0.36\nyarn_radius: 0.038\nellipse_long: 0.026\nellipse_short: 0.02\nepsilon: 0.1\nbeta: "
        "0.2\nR_max: 1\nflyaway_hair_ze: 0.002 0.06\n",
        "", 0);
    struct fiber_set f;
    fiber_set_init(&f);
    must(fiber_set_reserve(&f, 2, 5, NULL) == STATUS_OK, "memory");
    f.first_vertex[1] = 2;
    f.first_vertex[2] = 5;
    f.tile_size_m[0] = f.tile_size_m[1] = 1e-3;
    for (size_t i = 0; i < 15; i++) f.position_m[i] = (float)i * 1e-5f;
    for (size_t i = 0; i < 2; i++) f.radius_m[i] = 1e-5f;
    fiber_set_classify(&f);
    must(fiber_set_write_hair(&f, seed_path("hair", "two.hair"), NULL) == STATUS_OK, ".hair");
    must(fiber_set_write_text(&f, seed_path("fiber_text", "two.txt"), NULL) == STATUS_OK, "text");
    f.group[1] = 5;
    must(fiber_set_write_hair(&f, seed_path("hair", "groups.hair"), NULL) == STATUS_OK, ".hair");
    must(fiber_set_write_text(&f, seed_path("fiber_text", "groups.txt"), NULL) == STATUS_OK, "text");
    fiber_set_release(&f);
}

static void photograph_seeds(void)
{
    struct image im;
    must(image_init(&im, 8, 8, 3, NULL) == STATUS_OK, "memory");
    for (size_t i = 0; i < 192; i++) im.pixel[i] = 0.1f + (float)(i % 5) * 0.1f;
    must(image_write_exr(&im, seed_path("exr", "rgb.exr"), NULL) == STATUS_OK, "OpenEXR");
    must(image_write_png(&im, 1.0, seed_path("png", "rgb.png"), NULL) == STATUS_OK, "PNG");
    image_release(&im);
}

static void rig_seeds(void)
{
    static const char rig[] =
        "{\"selvedge_rig\":1,\"lamps\":{\"a\":{\"theta_deg\":20,\"phi_deg\":0}},\"cameras\":{\"c\":{\"position_mm\":[1,"
        "2,"
        "300]}},\"views\":{\"v\":{\"lamp\":\"a\",\"camera\":\"c\",\"cloth_rotation_deg\":30}},\"lens\":{\"distortion\":"
        "{"
        "\"focal_px\":[9,9],\"center_px\":[4,3],\"k\":[0,0,0],\"p\":[0,0]},\"vignetting\":{\"center_px\":[1,1],"
        "\"radius_px\":4,\"a\":[0,0,0]}},\"markers\":{\"dictionary\":\"4x4_50\",\"side_mm\":22,\"center_mm\":{\"3\":[-"
        "40,"
        "40],\"7\":[42,38]}}}";
    static const char charuco[] =
        "{\"selvedge_rig\":1,\"lamps\":{\"a\":{\"theta_deg\":20,\"phi_deg\":0}},\"views\":{\"v\":{\"lamp\":\"a\"}},"
        "\"markers\":{\"dictionary\":\"5x5_100\",\"side_mm\":8,\"charuco\":{\"squares\":[9,7],\"square_mm\":11,"
        "\"upper_left_mm\":[-49.5,38.5],\"first_square\":\"white\"}}}";
    put("rig", "all.json", rig, "", 0);
    put("rig", "charuco.json", charuco, "", 0);
}

static void camera_seeds(void)
{
    static uint8_t byte[16 * 16 * 4];
    static uint16_t word[32 * 32];
    for (size_t i = 0; i < sizeof byte; i++) byte[i] = (uint8_t)(i * 3);
    for (size_t i = 0; i < 32 * 32; i++) word[i] = (uint16_t)(512 + i * 9);
    camera_write_jpeg(seed_path("jpeg", "exif.jpg"), 16, 16, byte, 0.01);
    camera_write_tiff(seed_path("photograph_tiff", "u8.tif"), &(struct camera_tiff){16, 16, 3, 8, .deflate = true},
                      byte);
    camera_write_tiff(seed_path("photograph_tiff", "u16.tif"),
                      &(struct camera_tiff){16, 16, 1, 16, .exposure_s = 0.1, .iso = 100, .aperture = 8}, word);
    camera_write_tiff(seed_path("photograph_tiff", "f32.tif"), &(struct camera_tiff){8, 8, 4, 32, .planes = true},
                      byte);
    must(dng_file_write(seed_path("camera_raw", "bayer.dng"), &(struct dng_picture){32, 32, 512, 16383, 0.5, 100, 4},
                        word, NULL) == STATUS_OK,
         "a raw picture");
}

static void brdf_seeds(void)
{
    static struct rgl_bytes rgl[4] = {{.n_phi = 1},
                                      {.n_phi = 5, .turn_rad = 3.14159265, .some_not_measured = true},
                                      {.n_phi = 3, .turn_rad = 1.57079633},
                                      {.n_phi = 1, .n_wavelength = 8, .first_nm = 380, .step_nm = 45}};
    static const char *const name[4] = {"iso.bsdf", "half.bsdf", "quarter.bsdf", "spectra.bsdf"};
    static const double sample[8] = {1500, 700, 30, -1500, 0, 1e9, 12, 5};
    for (size_t i = 0; i < 4; i++) {
        rgl_bytes_make(&rgl[i]);
        put("brdf_rgl", name[i], "", rgl[i].bytes, rgl[i].n);
    }
    put("brdf_merl", "samples.binary", "", sample, sizeof sample);
    put("brdf_astm", "rgb.astm",
        "ASTM\nNUM_POINTS 4\nVARS "
        "theta_i,phi_i,theta_s,phi_s,R,G,B\n0.2,0,0.3,3.1,0.5,0.4,0.3\n0.4,0,0.3,3.1,0.6,0.4,0.3\n"
        "0.4,1,0.3,2.1,0.6,0.4,0.3\n1.4,2,1.3,2.1,0.6,0.4,-0.3\n",
        "", 0);
    put("brdf_astm", "spectra.astm",
        "VARS "
        "theta_i,phi_i,theta_s,phi_s,400nm,440nm,480nm,520nm,560nm,600nm,640nm,680nm\n20,0,30,180,1,2,3,4,5,6,7,8\n",
        "", 0);
    put("brdf_astm", "grey.astm", "VARS theta_i,phi_i,theta_s,phi_s,BRDF\r\n20,0,30,180,1\r\n100,0,30,180,1\r\n", "",
        0);
}

int main(int argc, char **argv)
{
    if (argc != 2) return 2;
    root = argv[1];
    mkdir(root, 0777);
    volume_seeds();
    header_seeds();
    fiber_seeds();
    photograph_seeds();
    camera_seeds();
    rig_seeds();
    brdf_seeds();
    return 0;
}
