//! `cargo xtask sign`: makes keys, signs images, and shows their content (docs/update.md).

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail, ensure};
use bsp::flash::update_layout::LAYOUT;
use clap::{Args, Parser, Subcommand, ValueEnum};
use programmer::sign::product::{self, version};
use programmer::sign::{code, image::Image, key, key_list};
use update::key::{KeyList, Rank};
use update::{Description, Version};

/// Keys and signed images for the field update.
#[derive(Parser)]
#[command(name = "cargo xtask sign", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make a key pair: the secret half goes to a new file, the public half is printed as the variable that the bootloader is built with
    Key {
        /// The new file
        file: PathBuf,
        /// The rank of the key in the bootloader
        #[arg(long, value_enum, default_value = "release")]
        rank: RankName,
    },
    /// Print the public half of a key
    Public {
        /// The secret key, PKCS#8 in PEM
        file: PathBuf,
        /// The rank of the key in the bootloader, which selects the variable; the file does not contain it
        #[arg(long, value_enum)]
        rank: Option<RankName>,
    },
    /// Certify a release key with the root key, or a root key with the recovery key
    KeyList(KeyListArgs),
    /// Sign an application, an ELF file or a flat binary
    Image(ImageArgs),
    /// Show the content of an image, and check it
    Show {
        /// The image
        file: PathBuf,
        /// A secret key, to see whether it signed the image [default: the development key]
        #[arg(long)]
        key: Option<PathBuf>,
    },
}

/// The rank of a key.
#[derive(Clone, Copy, ValueEnum)]
enum RankName {
    Release,
    Root,
    Recovery,
}

impl From<RankName> for Rank {
    fn from(name: RankName) -> Rank {
        match name {
            RankName::Release => Rank::Release,
            RankName::Root => Rank::Root,
            RankName::Recovery => Rank::Recovery,
        }
    }
}

#[derive(Args)]
struct KeyListArgs {
    /// The secret key that signs: the root key, or with --root the recovery key
    #[arg(long)]
    key: PathBuf,
    /// The release key: the 64 digits of its public half
    #[arg(long, value_name = "DIGITS", required_unless_present = "root", conflicts_with = "root")]
    release: Option<String>,
    /// The root key: the 64 digits of its public half
    #[arg(long, value_name = "DIGITS")]
    root: Option<String>,
    /// The number of the key: each one revokes those with lower numbers
    #[arg(long)]
    number: u32,
    /// The security counter from which the release key may raise it
    #[arg(long, default_value_t = 0, conflicts_with = "root")]
    counter: u32,
    /// The key list of a root key that is not that of the bootloader
    #[arg(long, value_name = "FILE", conflicts_with = "root")]
    after: Option<PathBuf>,
    /// The file for the key list
    #[arg(long, short)]
    out: PathBuf,
}

#[derive(Args)]
struct ImageArgs {
    /// The ELF file, or the binary from 0x08020200 on
    file: PathBuf,
    /// The secret key, PKCS#8 in PEM [default: the development key, which is published in the repository]
    #[arg(long)]
    key: Option<PathBuf>,
    /// The board that the image is for, as in 2004h:1
    #[arg(long, value_parser = number, default_value_t = product::BOARD)]
    board: u32,
    /// The hardware revisions that the image runs on, 0 to 31, with commas
    #[arg(long, value_delimiter = ',', default_value = "0", value_parser = clap::value_parser!(u32).range(0..32))]
    hardware: Vec<u32>,
    /// The version of the image, as 1.2.3
    #[arg(long = "image-version", value_parser = version, default_value = env!("CARGO_PKG_VERSION"))]
    version: Version,
    /// The security counter: raise it when no older image may ever run again
    #[arg(long, default_value_t = 0)]
    counter: u32,
    /// The key list with the release key [default: the release key is that of the bootloader]
    #[arg(long, value_name = "FILE")]
    key_list: Option<PathBuf>,
    /// The file for the image [default: the name of the file with .img]
    #[arg(long, short)]
    out: Option<PathBuf>,
}

fn number(text: &str) -> Result<u32> {
    Ok(match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16)?,
        None => text.parse()?,
    })
}

fn signing_key(path: Option<&Path>) -> Result<ed25519_dalek::SigningKey> {
    let development = key::development_path();
    let key = key::read(path.unwrap_or(&development))?;
    if key::is_development(&key) {
        eprintln!("warning: the development key is published in this repository, so anyone can sign with it");
    }
    Ok(key)
}

fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}

fn make_key(path: &Path, rank: RankName) -> Result<()> {
    let key = key::random()?;
    key::write(&key, path)?;
    println!("{}", key::variable(&key, rank.into()));
    Ok(())
}

/// The variable of a rank; without a rank, the digits after a neutral name.
fn public_line(key: &ed25519_dalek::SigningKey, rank: Option<RankName>) -> String {
    match rank {
        Some(rank) => key::variable(key, rank.into()),
        None => format!("PUBLIC_KEY={}", key::public_digits(key)),
    }
}

fn read_key_list(path: Option<&Path>) -> Result<KeyList> {
    let Some(path) = path else { return Ok(KeyList::default()) };
    key_list::read(&read(path)?).with_context(|| path.display().to_string())
}

fn make_key_list(args: &KeyListArgs) -> Result<()> {
    let by = signing_key(Some(&args.key))?;
    let list = match (&args.root, &args.release) {
        (Some(root), _) => key_list::with_root(&key::public(root)?, args.number, &by)?,
        (None, release) => {
            let key = key::public(release.as_deref().unwrap_or_default())?;
            let before = read_key_list(args.after.as_deref())?;
            key_list::with_release(before, &key, args.number, args.counter, &by)?
        }
    };
    std::fs::write(&args.out, list.encode())
        .with_context(|| format!("cannot write {}", args.out.display()))?;
    show_keys(&list);
    Ok(())
}

fn show_keys(list: &KeyList) {
    println!("generation  {}", list.generation());
    for (name, certificate) in [("root", list.root), ("release", list.release)] {
        if let Some(certificate) = certificate {
            println!("{name:<12}{}", hex::encode(certificate.key));
        }
    }
}

fn make_image(args: &ImageArgs) -> Result<()> {
    let key = signing_key(args.key.as_deref())?;
    let code = code::read(&read(&args.file)?).with_context(|| args.file.display().to_string())?;
    let hardware = args.hardware.iter().fold(0, |mask, revision| mask | 1 << revision);
    ensure!(
        args.counter <= LAYOUT.highest_counter(),
        "a node keeps counters up to {}, and not {}",
        LAYOUT.highest_counter(),
        args.counter
    );
    let keys = read_key_list(args.key_list.as_deref())?;
    let is_of_list = keys.release.is_none_or(|release| release.key == key.verifying_key().to_bytes());
    ensure!(
        is_of_list && (keys.release.is_some() || keys.root.is_none()),
        "the key is not the release key of the list"
    );
    let description =
        Description { board: args.board, hardware, version: args.version, counter: args.counter, keys };
    let image = Image::sign(description, code, &key)?;
    let out = args.out.clone().unwrap_or_else(|| args.file.with_extension("img"));
    std::fs::write(&out, image.to_bytes()).with_context(|| format!("cannot write {}", out.display()))?;
    show(&image);
    println!("file        {}", out.display());
    Ok(())
}

fn show(image: &Image) {
    let about = image.header.description();
    let revisions = (0..32).filter(|revision| about.hardware >> revision & 1 != 0);
    let revisions: Vec<_> = revisions.map(|revision: u32| revision.to_string()).collect();
    println!("version     {}", about.version);
    println!("board       {:#010x}", about.board);
    println!("hardware    {}", revisions.join(", "));
    println!("counter     {}", about.counter);
    show_keys(&about.keys);
    println!("code        {} bytes, CRC-32 {:#010x} (1F56h)", image.header.length(), image.header.code_crc());
}

fn show_file(file: &Path, key: Option<&Path>) -> Result<()> {
    let image = Image::read(&read(file)?).with_context(|| file.display().to_string())?;
    show(&image);
    if !image.is_signed_by(&signing_key(key)?.verifying_key()) {
        bail!("it was not signed with this key");
    }
    println!("signature   good");
    Ok(())
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Key { file, rank } => make_key(&file, rank),
        Command::KeyList(args) => make_key_list(&args),
        Command::Public { file, rank } => key::read(&file).map(|key| println!("{}", public_line(&key, rank))),
        Command::Image(args) => make_image(&args),
        Command::Show { file, key } => show_file(&file, key.as_deref()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
