// Decodes MAVLink bytes from standard input with node-mavlink's own definitions. Prints one JSON object: how many packets
// of each message were valid, how many were not, which ids it does not know, and the last values of some messages.
const {
  MavLinkPacketSplitter, MavLinkPacketParser, minimal, common, standard, ardupilotmega, development,
} = require('node-mavlink')

const REGISTRY = {
  ...minimal.REGISTRY, ...standard.REGISTRY, ...common.REGISTRY, ...ardupilotmega.REGISTRY, ...development.REGISTRY,
}
const counts = {}
const last = {}
const unknown = {}
const splitter = new MavLinkPacketSplitter({}, { onUnknownPackage: () => {}, onCrcError: () => {} })
const parser = new MavLinkPacketParser()

parser.on('data', (packet) => {
  const type = REGISTRY[packet.header.msgid]
  if (type === undefined) {
    unknown[packet.header.msgid] = (unknown[packet.header.msgid] || 0) + 1
    return
  }
  const message = packet.protocol.data(packet.payload, type)
  counts[type.MSG_NAME] = (counts[type.MSG_NAME] || 0) + 1
  last[type.MSG_NAME] = message
})
parser.on('end', () => {
  const plain = (_, value) => (typeof value === 'bigint' ? Number(value) : value)
  const { validPackages, invalidPackages, unknownPackagesCount } = splitter
  console.log(JSON.stringify({ validPackages, invalidPackages, unknownPackagesCount, counts, unknown, last }, plain))
})
process.stdin.pipe(splitter).pipe(parser)
