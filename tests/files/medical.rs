//! Files that other programs write: NIfTI by nibabel, DICOM by pydicom, and the test files that
//! pydicom brings. Skipped, with a word, where Python or one of its packages is missing.
//!
//! `SPLATKIT_PYTHON` names another Python than `python3`.

use crate::testing::folder::Folder;
use splatkit::{
    formats::{ReadOptions, load_volume},
    glam::DVec3,
    input::Limits,
    volume::Volume,
};
use std::{path::Path, process::Command};

/// Runs a script in a folder. Returns its output, or `None` if a package is missing.
fn python(folder: &Folder, script: &str) -> Option<Vec<serde_json::Value>> {
    let program = std::env::var_os("SPLATKIT_PYTHON").unwrap_or("python3".into());
    let mut run = Command::new(program);
    run.args(["-W", "ignore", "-c", script]).current_dir(folder);
    let output = run.output().ok()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    if errors.contains("ModuleNotFoundError") || errors.contains("ImportError") {
        println!("skipped: {}", errors.lines().last().unwrap_or_default());
        return None;
    }
    assert!(output.status.success(), "{errors}");
    let lines = String::from_utf8(output.stdout).expect("text");
    Some(lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect())
}

fn load(path: &Path, time: Option<usize>) -> splatkit::Result<Volume> {
    load_volume(path, &Limits::default(), &ReadOptions { time, ..ReadOptions::default() })
}

/// Asserts that a volume has the values and the places that a line states: `shape`, `values` (some
/// samples with their indices along x, y and z), `sum`, and `places` (some positions likewise).
fn compare(volume: &Volume, line: &serde_json::Value) {
    let name = &line["file"];
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect()
    };
    let dims = volume.lattice.dims;
    assert_eq!(numbers(&line["shape"]), dims.map(|n| n as f64), "{name}");
    let sum: f64 = (0..volume.len()).map(|i| volume.value(i)).sum();
    let expected = line["sum"].as_f64().expect("a sum");
    assert!((sum - expected).abs() <= 1e-6 * expected.abs().max(1.0), "{name}: {sum}, {expected}");
    for sample in line["samples"].as_array().expect("a list") {
        let [i, j, k, value] = numbers(sample)[..4].try_into().expect("four numbers");
        let index = [i, j, k].map(|n| n as usize);
        let at = index[0] + dims[0] * (index[1] + dims[1] * index[2]);
        assert!(
            (volume.value(at) - value).abs() <= 1e-6 * value.abs().max(1.0),
            "{name}: {sample}"
        );
        if let Some(place) = numbers(sample).get(4..7) {
            let position = volume.lattice.sample_position(at);
            let expected = DVec3::from_slice(place);
            assert!(position.distance(expected) < 1e-3, "{name}: {position}, {expected}");
        }
    }
}

/// Samples of an array `a[x, y, z]`, with places by a function of their indices.
const TELL: &str = r#"
import json
import numpy as np
def tell(name, a, place=None, **more):
    n = a.shape
    at = [(0, 0, 0), tuple(c - 1 for c in n), tuple(c // 2 for c in n), (n[0] - 1, 0, 0)]
    samples = []
    for i in at:
        where = [] if place is None else [float(v) for v in place(*i)]
        samples.append([*i, float(a[i]), *where])
    total = float(np.sum(a, dtype=np.float64))
    print(json.dumps(dict(file=name, shape=n, samples=samples, sum=total, **more)))
"#;

const NIBABEL: &str = r#"
import nibabel as nib
rng = np.random.default_rng(7)
c, s = np.cos(0.3), np.sin(0.3)
turned = np.array([[c, -s, 0, -31.5], [s, c, 0, 12], [0, 0, 1, 7.25], [0, 0, 0, 1]])
affine = turned @ np.diag([-0.5, 0.75, 2.5, 1])
sheared = affine.copy()
sheared[:3, 2] += [0.3, -0.4, 0]
kinds = [np.uint8, np.int8, np.int16, np.uint16, np.int32, np.uint32, np.float32, np.float64]
def save(image, name, time=None, values=None, data=None):
    nib.save(image, name)
    again = nib.load(name)
    a = again.get_fdata() if values is None else values
    a = a if time is None else a[..., time]
    place = lambda i, j, k: (again.affine @ [i, j, k, 1])[:3]
    tell(name, np.asarray(a, np.float64), place, time=time)
for version, make in [(1, nib.Nifti1Image), (2, nib.Nifti2Image)]:
    for at, kind in enumerate(kinds):
        a = (100 * rng.random((5, 4, 3))).astype(kind)
        image = make(a, sheared if at % 2 else affine)
        image.header.set_xyzt_units('mm')
        if at % 2 == 0:
            image.set_sform(None, 0)
            image.set_qform(affine, 1)
        if at % 3 == 0:
            image.header.set_slope_inter(0.25, -3)
        name = f'{version}{kind.__name__}' + ['.nii', '.nii.gz'][at % 2]
        save(image, name)
    big = make(rng.integers(0, 99, (5, 4, 3)).astype('>i2'), affine,
               make.header_class(endianness='>'))
    save(big, f'{version}big.nii.gz')
    times = make(rng.integers(0, 99, (5, 4, 3, 6)).astype(np.int16), affine)
    save(times, f'{version}times.nii.gz', 4)
    z = (rng.random((5, 4, 3)) + 1j * rng.random((5, 4, 3))).astype(np.complex64)
    save(make(z, affine), f'{version}complex.nii', values=np.abs(z))
    extended = make(rng.integers(0, 99, (5, 4, 3)).astype(np.uint8), affine)
    extended.header.extensions.append(nib.nifti1.Nifti1Extension('comment', b'twelve words'))
    save(extended, f'{version}extended.nii')
pair = nib.Nifti1Pair(rng.integers(0, 99, (5, 4, 3)).astype(np.int16), affine)
save(pair, 'pair.hdr')
old = nib.AnalyzeImage(rng.integers(0, 99, (5, 4, 3)).astype(np.int16), None)
nib.save(old, 'analyze.hdr')
tell('analyze.hdr', np.asarray(nib.load('analyze.hdr').dataobj, np.float64), time=None)
"#;

#[test]
fn files_of_nibabel() {
    let folder = Folder::new();
    let Some(lines) = python(&folder, &[TELL, NIBABEL].concat()) else { return };
    assert_eq!(lines.len(), 26);
    for line in lines {
        let path = folder.path(line["file"].as_str().expect("a name"));
        let time = line["time"].as_u64().map(|time| time as usize);
        compare(&load(&path, time).unwrap(), &line);
    }
}

const PYDICOM: &str = r#"
import os
import pydicom
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.uid import generate_uid, ExplicitVRLittleEndian, ImplicitVRLittleEndian, RLELossless
rng = np.random.default_rng(5)
def slice_of(position, a, series, number, syntax, intercept=-1024):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = '1.2.840.10008.5.1.4.1.1.2'
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = syntax
    d = FileDataset('', {}, file_meta=meta, preamble=b'\0' * 128)
    d.SOPClassUID, d.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
    d.SeriesInstanceUID, d.Modality, d.InstanceNumber = series, 'CT', number
    d.ImagePositionPatient, d.ImageOrientationPatient = list(position), [1, 0, 0, 0, 1, 0]
    d.PixelSpacing, d.SliceThickness = [0.5, 0.7], 2
    d.Rows, d.Columns = a.shape[1], a.shape[0]
    d.SamplesPerPixel, d.PhotometricInterpretation = 1, 'MONOCHROME2'
    d.BitsAllocated, d.BitsStored, d.HighBit, d.PixelRepresentation = 16, 12, 11, 0
    d.RescaleSlope, d.RescaleIntercept = 1, intercept
    d.add_new((0x0009, 0x0010), 'LO', 'PRIVATE')
    d.add_new((0x0009, 0x1001), 'SQ', [Dataset(), Dataset()])
    d.set_pixel_data(a.T.astype(np.uint16), 'MONOCHROME2', 12)
    if syntax == RLELossless:
        d.compress(RLELossless, generate_instance_uid=False)
    return d
for name, syntax, tilt in [('plain', ExplicitVRLittleEndian, 0),
                           ('tilt', ImplicitVRLittleEndian, 0.4), ('rle', RLELossless, 0)]:
    os.mkdir(name)
    series, n = generate_uid(), 5
    a = rng.integers(0, 4096, (6, 4, n))
    place = lambda i, j, k: (0.7 * i - 11, 0.5 * j + 3 + tilt * k, 2.5 * k - 40)
    for at, k in enumerate(rng.permutation(n)):
        d = slice_of(place(0, 0, int(k)), a[:, :, k], series, int(k), syntax)
        d.save_as(f'{name}/{at}', enforce_file_format=True)
    # DICOM's x leads to the left and y to the back, and a patient's to the right and the front.
    tell(name, a.astype(np.float64) - 1024,
         lambda i, j, k: (-place(i, j, k)[0], -place(i, j, k)[1], place(i, j, k)[2]))
"#;

#[test]
fn series_of_pydicom() {
    let folder = Folder::new();
    let Some(lines) = python(&folder, &[TELL, PYDICOM].concat()) else { return };
    for line in lines {
        let volume = load(&folder.path(line["file"].as_str().expect("a name")), None).unwrap();
        compare(&volume, &line);
        assert_eq!(volume.about.unit, "HU");
    }
}

/// Every file that pydicom brings, with its pixels as pydicom decodes them: scaled by slope and
/// intercept, the frames along z. Colours and inverted values are left out.
const BROUGHT: &str = r#"
import glob
import os
import pydicom
from pydicom.pixels import apply_modality_lut
here = os.path.join(os.path.dirname(pydicom.__file__), 'data', 'test_files')
for path in sorted(glob.glob(here + '/*.dcm')):
    name = os.path.basename(path)
    try:
        d = pydicom.dcmread(path, force=True)
        a = d.pixel_array
        if d.PhotometricInterpretation != 'MONOCHROME2' or 'ModalityLUTSequence' in d:
            raise ValueError('colours')
        padding = d.get('PixelPaddingValue')
        if padding is not None and (a == padding).any():
            raise ValueError('holes')
        a = apply_modality_lut(a, d)
        a = a * float(d.get('DoseGridScaling', 1))
    except Exception as problem:
        print(json.dumps(dict(file=name, path=path, problem=str(problem)[:80])))
        continue
    a = a if a.ndim == 3 else a[None]
    tell(name, np.asarray(a, np.float64).transpose(2, 1, 0), path=path)
"#;

/// Files whose frames show several times; one of them is read.
const FILMS: [&str; 2] = ["eCT_Supplemental.dcm", "emri_small"];

#[test]
fn files_that_pydicom_brings() {
    let folder = Folder::new();
    let Some(lines) = python(&folder, &[TELL, BROUGHT].concat()) else { return };
    let mut compared = 0;
    for line in lines {
        let path = Path::new(line["path"].as_str().expect("a path"));
        let name = line["file"].as_str().expect("a name");
        match load(path, None) {
            Ok(_) if line["problem"].is_string() => println!("read: {name}: {}", line["problem"]),
            Ok(volume) if FILMS.iter().any(|film| name.starts_with(film)) => {
                println!("a film: {name}: {:?}", volume.lattice.dims);
            }
            Ok(volume) => {
                compare(&volume, &line);
                compared += 1;
            }
            Err(error) => println!("not read: {error}"),
        }
    }
    assert!(compared >= 20, "{compared} files were compared");
}
